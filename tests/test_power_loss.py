"""A store whose power goes: what was not asked to reach the disk may be lost, cut or older."""

from __future__ import annotations

import os
import random
from pathlib import Path

import pytest

from aeroflutter.errors import InputError
from aeroflutter.studies.maps import Store, Threads, run
from tests.test_maps_store import Toy, complete, expected


class PowerLoss(BaseException):
    """The lights go out."""


class Disk:
    """What has reached the disk: contents by inode, entries of folders by inode."""

    def __init__(self) -> None:
        self.contents: dict[int, bytes] = {}
        self.entries: dict[int, dict[str, int]] = {}
        self.calls, self.last = 0, None
        self.fsync = os.fsync

    def sync(self, descriptor: int) -> None:
        self.calls += 1
        if self.last is not None and self.calls > self.last:
            raise PowerLoss
        path = Path(f"/proc/self/fd/{descriptor}").resolve()
        inode = os.fstat(descriptor).st_ino
        if path.is_dir():
            self.entries[inode] = {one.name: one.lstat().st_ino for one in path.iterdir()}
        else:
            self.contents[inode] = path.read_bytes()

    def after_loss(self, now: Path, then: Path, chance: random.Random) -> None:
        """A folder as it may be found afterwards."""
        then.mkdir()
        safe = self.entries.get(now.stat().st_ino, {})
        current = {one.name: one for one in now.iterdir()}
        for name in sorted({*safe, *current}):
            newer = name in current and current[name].lstat().st_ino != safe.get(name)
            if (newer and chance.random() < 0.5) or name not in current:
                # The entry is the older one; of a folder that went away nothing is known.
                if safe.get(name) in self.contents:
                    (then / name).write_bytes(self.contents[safe[name]])
            elif current[name].is_dir():
                self.after_loss(current[name], then / name, chance)
            else:
                (then / name).write_bytes(self._content(current[name], chance))

    def _content(self, file: Path, chance: random.Random) -> bytes:
        written = file.read_bytes()
        if self.contents.get(file.stat().st_ino) == written:
            return written
        cut = written[: chance.randrange(len(written) + 1)]
        return chance.choice([written, b"", cut, bytes(len(written))])


@pytest.mark.parametrize(
    "seed", [*range(8), *(pytest.param(s, marks=pytest.mark.slow) for s in range(8, 200))]
)
def test_no_committed_block_is_lost_with_the_power(tmp_path: Path, monkeypatch, seed: int) -> None:
    chance = random.Random(seed)
    disk = Disk()
    monkeypatch.setattr(os, "fsync", disk.sync)
    path = tmp_path / "now" / "a.zarr"
    path.parent.mkdir()
    reported: list[tuple[str, int]] = []
    disk.last = chance.randrange(20, 520)
    try:
        store = Store.create(path, Toy())
        run(Toy(), store, Threads(1), lambda state: reported.append((state.phase, state.done)))
        store.close()
    except PowerLoss:
        pass
    disk.last = None
    disk.after_loss(path.parent, tmp_path / "then", chance)
    found = tmp_path / "then" / "a.zarr"
    if not reported:
        with pytest.raises(InputError, match="no store to resume"):
            Store.resume(found, Toy())
        return
    again = Store.resume(found, Toy())
    for phase in ("cells", "edges"):
        cells = max((done for of, done in reported if of == phase), default=0)
        assert 4000 * again.done(phase).sum() >= cells, again.mended
    run(Toy(), again, Threads(1))
    again.close()
    assert complete(again) == expected()
