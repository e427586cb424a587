"""The store of a study: what it refuses, what it survives."""

from __future__ import annotations

import json
import os
import resource
import shutil
import signal
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import zarr

from aeroflutter.errors import AeroflutterError, InputError
from aeroflutter.studies.maps import Processes, Store, StoreFull, Threads, run
from aeroflutter.studies.maps.results import MemoryResults
from aeroflutter.studies.maps.store import MARK, differing
from aeroflutter.studies.maps.study import Outcome, Task, Variable


@dataclass(frozen=True, eq=False)
class Toy:
    """A study without physics: noise that its cells' numbers determine."""

    shape: tuple[int, int] = (12, 2000)
    block_shape: tuple[int, int] = (2, 2000)
    about: dict[str, Any] = field(default_factory=lambda: {"mu": 100.0})
    kind: str = "toy"
    phases: tuple[str, ...] = ("cells", "edges")
    variables: tuple[Variable, ...] = (
        Variable("state", "i1", -1),
        Variable("noise", "f8", np.nan),
        Variable("edge", "f8", np.nan, "edges"),
        Variable("label", "i4", 0, "labels"),
    )

    @property
    def dimensions(self):
        return {"x": np.arange(self.shape[0]) * 1.0, "y": np.arange(self.shape[1]) * 1.0}

    def identity(self):
        return {"case": self.about, "shape": self.shape, "version": "1"}

    def tasks(self, phase, results):
        given = {"state": results.read("state")} if phase == "edges" else {}
        return [
            Task(phase, k, (slice(start, start + 2), slice(0, self.shape[1])), given)
            for k, start in enumerate(range(0, self.shape[0], 2))
        ]

    def compute(self, task):
        size = (2, self.shape[1])
        noise = np.random.default_rng(task.number).random(size)
        if task.phase == "edges":
            return {"edge": noise + task.given["state"][task.region]}
        return {"state": (noise > 0.5).astype(np.int8), "noise": noise}

    def failed(self, task):
        size = (2, self.shape[1])
        names = [v for v in self.variables if v.phase == task.phase]
        return {v.name: np.full(size, v.fill, dtype=v.dtype) for v in names}

    def describe(self, task):
        return f"block {task.number} of {task.phase}"

    def warm_up(self):
        pass


@dataclass(frozen=True, eq=False)
class Lethal(Toy):
    """Kills the worker that computes block 2, as often as `lives` says; counts in a file."""

    lives: int = 1
    folder: str = ""

    def compute(self, task):
        counter = Path(self.folder) / "deaths"
        deaths = len(counter.read_text()) if counter.exists() else 0
        if task.number == 2 and task.phase == "cells" and deaths < self.lives:
            counter.write_text("x" * (deaths + 1))
            os.kill(os.getpid(), signal.SIGKILL)
        return super().compute(task)


def complete(store: Store | MemoryResults) -> dict[str, bytes]:
    return {v.name: np.asarray(store.read(v.name)).tobytes() for v in store_study(store).variables}


def store_study(store) -> Toy:
    return getattr(store, "study", Toy())


def expected() -> dict[str, bytes]:
    results = MemoryResults(Toy())
    run(Toy(), results, Threads(1))
    return complete(results)


@pytest.fixture(scope="module")
def finished(tmp_path_factory) -> Path:
    """A finished store, for the tests to copy."""
    path = tmp_path_factory.mktemp("finished") / "a.zarr"
    store = Store.create(path, Toy())
    run(Toy(), store, Threads(1))
    store.close()
    return path


@pytest.fixture
def whole(finished: Path, tmp_path: Path) -> Path:
    """A finished store of one's own."""
    return Path(shutil.copytree(finished, tmp_path / "a.zarr"))


def test_a_store_holds_what_was_computed_and_opens_with_other_tools(tmp_path: Path) -> None:
    store = Store.create(tmp_path / "a.zarr", Toy())
    run(Toy(), store, Threads(2))
    store.close()
    assert complete(store) == expected()
    group = zarr.open_group(tmp_path / "a.zarr", mode="r")
    assert group["noise"].shape == (12, 2000)
    assert group["noise"].metadata.dimension_names == ("x", "y")
    assert group.attrs[MARK]["identity"]["case"] == {"mu": 100.0}


def test_a_run_cut_short_goes_on_where_it_was(tmp_path: Path) -> None:
    store = Store.create(tmp_path / "a.zarr", Toy())
    with pytest.raises(KeyboardInterrupt):
        run(Toy(), store, Threads(1), _stop_after(3))
    store.close()
    computed: list[int] = []

    class Watched(Toy):
        def compute(self, task):
            computed.append((task.phase, task.number))
            return super().compute(task)

    again = Store.resume(tmp_path / "a.zarr", Watched())
    assert again.done("cells").sum() == 3
    run(Watched(), again, Threads(1))
    again.close()
    assert len(computed) == 3 + 6
    assert complete(again) == expected()


def test_ctrl_c_within_a_write_waits_until_its_end(tmp_path: Path) -> None:
    """Amid zarr's own threads it could leave a lock behind, and the run would hang for ever."""
    store = Store.create(tmp_path / "a.zarr", Toy())
    arrays = {"state": np.zeros((2, 2000), dtype=np.int8), "noise": np.zeros((2, 2000))}
    task = Toy().tasks("cells", store)[1]
    safe = store._make_safe

    def interrupted(*names: Any) -> None:
        os.kill(os.getpid(), signal.SIGINT)
        safe(*names)

    store._make_safe = interrupted  # type: ignore[method-assign]
    with pytest.raises(KeyboardInterrupt):
        store.write(Outcome(task, arrays, 0.0, None))
    assert store.done("cells").tolist() == [False, True, False, False, False, False]
    assert signal.getsignal(signal.SIGINT) is signal.default_int_handler
    store.close()


def _stop_after(blocks: int):
    seen = []

    def report(state) -> None:
        seen.append(state)
        if len(seen) > blocks:
            raise KeyboardInterrupt

    return report


def test_nothing_is_overwritten_unasked(tmp_path: Path) -> None:
    path = tmp_path / "a.zarr"
    Store.create(path, Toy()).close()
    with pytest.raises(InputError, match=r"exists.*--resume.*--overwrite"):
        Store.create(path, Toy())
    Store.create(path, Toy(), overwrite=True).close()


def test_what_is_not_ours_is_never_removed(tmp_path: Path) -> None:
    foreign = tmp_path / "photos"
    foreign.mkdir()
    (foreign / "cat.png").write_text("meow")
    with pytest.raises(InputError, match=r"no store of aeroflutter.*not overwritten"):
        Store.create(foreign, Toy(), overwrite=True)
    assert (foreign / "cat.png").exists()
    with pytest.raises(InputError, match="no zarr group"):
        Store.resume(foreign, Toy())
    other = tmp_path / "other.zarr"
    zarr.open_group(other, mode="w", zarr_format=3)
    with pytest.raises(InputError, match="no store of aeroflutter"):
        Store.resume(other, Toy())
    with pytest.raises(InputError, match="no store to resume"):
        Store.resume(tmp_path / "none.zarr", Toy())


def test_another_case_or_grid_is_refused_with_the_difference(tmp_path: Path) -> None:
    path = tmp_path / "a.zarr"
    Store.create(path, Toy()).close()
    with pytest.raises(InputError) as refusal:
        Store.resume(path, Toy(about={"mu": 50.0}))
    assert "case.mu is 100.0 in the store, 50.0 here" in str(refusal.value)
    with pytest.raises(InputError, match="shape"):
        Store.resume(path, Toy(shape=(14, 2000)))


def test_differences_are_named_and_limited() -> None:
    assert differing({"a": {"b": 1}, "c": 2}, {"a": {"b": 2}, "d": (1, 2)}) == [
        "a.b is 1 in the store, 2 here",
        "c is 2 in the store, absent here",
        "d is absent in the store, [1, 2] here",
    ]
    many = differing({str(i): 0 for i in range(30)}, {str(i): 1 for i in range(30)})
    assert len(many) == 9
    assert many[-1] == "and 22 more differences"


@pytest.mark.parametrize("name", ["noise/c/0/0", "state/c/2/0", "blocks/cells/c/1/0"])
@pytest.mark.parametrize("how", ["flip", "cut", "drop"])
def test_a_damaged_block_is_computed_again_and_no_other(whole: Path, name: str, how: str) -> None:
    path = whole
    chunk = path / name
    data = bytearray(chunk.read_bytes())
    if how == "flip":
        data[len(data) // 2] ^= 0xFF
        chunk.write_bytes(data)
    elif how == "cut":
        chunk.write_bytes(data[: len(data) // 2])
    else:
        chunk.unlink()
    number = int(name.split("/")[-2])
    again = Store.resume(path, Toy())
    if (how, name.split("/")[0]) != ("drop", "blocks"):  # a marker lost is a block not computed
        assert again.mended == (f"block {number} of cells was damaged; it is computed again",)
    assert list(np.flatnonzero(~again.done("cells"))) == [number]
    assert again.done("edges").all()
    run(Toy(), again, Threads(1))
    again.close()
    assert complete(again) == expected()


@pytest.mark.parametrize("text", ["", "{", "[]", '{"zarr_format": 3, "node_type": "group"}'])
@pytest.mark.parametrize("part", [".", "blocks", "noise", "x", "blocks/edges", "blocks/cells_cpu"])
def test_a_description_that_is_damaged_is_written_anew(whole: Path, text: str, part: str) -> None:
    path = whole
    (path / part / "zarr.json").write_text(text)
    again = Store.resume(path, Toy())
    assert again.done("cells").all()
    assert again.done("edges").all()
    assert all("damaged" in line for line in again.mended)
    assert len(again.mended) == (part != "blocks")
    again.close()
    assert complete(again) == expected()
    assert np.isfinite(again.cpu_seconds)
    Store.create(path, Toy(), overwrite=True).close()


def test_a_store_without_either_description_is_left_alone(whole: Path) -> None:
    path = whole
    for part in (".", "blocks"):
        (path / part / "zarr.json").write_text("{")
    for take in (Store.resume, lambda *args: Store.create(*args, overwrite=True)):
        with pytest.raises(InputError, match="no store of aeroflutter") as refusal:
            take(path, Toy())
        assert len(refusal.value.problems) == 1
    assert (path / "noise/c/0/0").exists()


@pytest.mark.parametrize("victim", ["noise", "x", "blocks", "blocks/cells", "y/c", "x/c/0"])
def test_a_missing_part_is_made_again(whole: Path, victim: str) -> None:
    path = whole
    target = path / victim
    shutil.rmtree(target) if target.is_dir() else target.unlink()
    again = Store.resume(path, Toy())
    assert again.mended
    run(Toy(), again, Threads(1))
    again.close()
    assert complete(again) == expected()
    group = zarr.open_group(path, mode="r")
    assert all(np.array_equal(group[name][:], v) for name, v in Toy().dimensions.items())


def test_another_format_is_refused(tmp_path: Path) -> None:
    path = tmp_path / "a.zarr"
    Store.create(path, Toy()).close()
    about = json.loads((path / "zarr.json").read_text())
    about["attributes"][MARK]["format"] = 99
    (path / "zarr.json").write_text(json.dumps(about))
    with pytest.raises(InputError, match="format 99"):
        Store.resume(path, Toy())


def test_two_runs_do_not_write_to_one_store(tmp_path: Path) -> None:
    path = tmp_path / "a.zarr"
    store = Store.create(path, Toy())
    with pytest.raises(InputError, match="another run"):
        Store.resume(path, Toy())
    with pytest.raises(InputError, match="another run"):
        Store.create(path, Toy(), overwrite=True)
    store.close()
    Store.resume(path, Toy()).close()


def test_a_full_disk_says_so_and_spoils_nothing(tmp_path: Path) -> None:
    path = tmp_path / "a.zarr"
    store = Store.create(path, Toy())
    soft, hard = resource.getrlimit(resource.RLIMIT_FSIZE)
    done = 0

    def fill_up(state) -> None:
        nonlocal done
        done += state.done > 0
        if done == 2:
            resource.setrlimit(resource.RLIMIT_FSIZE, (8192, hard))

    try:
        with pytest.raises(StoreFull, match=r"a\.zarr: no room to write"):
            run(Toy(), store, Threads(1), fill_up)
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, (soft, hard))
    store.close()
    again = Store.resume(path, Toy())
    assert again.done("cells").sum() == 2
    run(Toy(), again, Threads(1))
    again.close()
    assert complete(again) == expected()


def test_a_dead_worker_costs_its_block_only(tmp_path: Path) -> None:
    study = Lethal(lives=2, folder=str(tmp_path))
    results = MemoryResults(study)
    run(study, results, Processes(2))
    assert (tmp_path / "deaths").read_text() == "xx"
    assert results.failures == []
    assert complete(results) == expected()


def test_a_block_that_kills_three_workers_is_given_up(tmp_path: Path) -> None:
    study = Lethal(lives=99, folder=str(tmp_path))
    store = Store.create(tmp_path / "a.zarr", study)
    run(study, store, Processes(2))
    [failure] = store.failures
    assert failure["block"] == "block 2 of cells"
    assert "3 workers died" in failure["reason"]
    store.close()
    noise = store.read("noise")
    assert np.all(np.isnan(noise[4:6]))
    assert not np.any(np.isnan(np.delete(noise, [4, 5], axis=0)))
    healed = Lethal(lives=0, folder=str(tmp_path))
    again = Store.resume(tmp_path / "a.zarr", healed)
    assert again.failures == []
    run(healed, again, Threads(1))
    again.close()
    assert np.asarray(again.read("noise")).tobytes() == expected()["noise"]


class Stillborn(Toy):
    def warm_up(self):
        os._exit(7)


def test_workers_that_cannot_start_end_the_run() -> None:
    study = Stillborn()
    with pytest.raises(AeroflutterError, match="die as they start"):
        run(study, MemoryResults(study), Processes(1))


def test_a_marker_is_written_after_its_data(tmp_path: Path, monkeypatch) -> None:
    store = Store.create(tmp_path / "a.zarr", Toy())
    task = Toy().tasks("cells", store)[0]
    arrays = Toy().compute(task)

    def no_marker(values):
        raise KeyboardInterrupt

    monkeypatch.setattr("aeroflutter.studies.maps.store._digest", no_marker)
    with pytest.raises(KeyboardInterrupt):
        store.write(Outcome(task, arrays))
    assert np.array_equal(store.read("noise", task.region), arrays["noise"])
    assert not store.done("cells").any()
    store.close()


@pytest.mark.parametrize("place", ["notes", "noise/notes", "noise/c/0/notes", "mine/zarr.json"])
def test_only_what_a_store_consists_of_is_deleted(whole: Path, place: str) -> None:
    note = whole / place
    note.parent.mkdir(exist_ok=True)
    note.write_text("mine")
    with pytest.raises(InputError, match=rf"holds {place}.*not overwritten"):
        Store.create(whole, Toy(), overwrite=True)
    assert note.read_text() == "mine"
    assert Store.resume(whole, Toy()).done("cells").all()


@pytest.mark.parametrize(
    "text",
    [
        f'{{"zarr_format": 3, "node_type": "group", "attributes": {{"about": "{MARK}"}}}}',
        f'{{"attributes": {{"{MARK}": "of a friend"}}}}',
        f'{{"attributes": {{"{MARK}": {{"identity": 3}}}}}}',
    ],
)
def test_the_word_alone_makes_no_store(tmp_path: Path, text: str) -> None:
    path = tmp_path / "a.zarr"
    path.mkdir()
    (path / "zarr.json").write_text(text)
    with pytest.raises(InputError, match="no store of aeroflutter"):
        Store.create(path, Toy(), overwrite=True)
    with pytest.raises(InputError, match="no store of aeroflutter"):
        Store.resume(path, Toy())


def test_a_link_to_a_store_is_not_overwritten(tmp_path: Path, whole: Path) -> None:
    (tmp_path / "link.zarr").symlink_to(whole)
    with pytest.raises(InputError, match="no store of aeroflutter"):
        Store.create(tmp_path / "link.zarr", Toy(), overwrite=True)


def test_the_folder_of_a_neighbour_stays(tmp_path: Path) -> None:
    for name in (".a.zarr.part", ".aeroflutter-mine.part", ".aeroflutter-" + "0" * 32 + ".part"):
        (tmp_path / name).mkdir()
        (tmp_path / name / "diary.txt").write_text("dear")
        os.utime(tmp_path / name, (0, 0))
    Store.create(tmp_path / "a.zarr", Toy()).close()
    assert len(list(tmp_path.glob("*/diary.txt"))) == 3


def test_what_a_killed_run_left_is_cleared_an_hour_later(tmp_path: Path, whole: Path) -> None:
    half = tmp_path / (".aeroflutter-" + "1" * 32 + ".part")
    whole.rename(half)
    Store.create(tmp_path / "b.zarr", Toy()).close()
    assert half.exists()
    os.utime(half, (0, 0))
    Store.create(tmp_path / "c.zarr", Toy()).close()
    assert not half.exists()


def test_a_store_finished_meanwhile_is_not_replaced(
    tmp_path: Path, whole: Path, monkeypatch
) -> None:
    """Two runs find the name free; the one that lays out its store last is refused."""
    target = tmp_path / "b.zarr"
    monkeypatch.setattr(
        "aeroflutter.studies.maps.store.lay_out", lambda part, study: whole.rename(target)
    )
    with pytest.raises(InputError, match="exists"):
        Store.create(target, Toy())
    assert Store.resume(target, Toy()).done("edges").all()
    assert [one.name for one in tmp_path.iterdir() if one.name.startswith(".")] == []


@pytest.mark.parametrize("how", ["renamed", "removed", "replaced"])
def test_a_store_that_goes_away_stops_the_run(tmp_path: Path, how: str) -> None:
    path = tmp_path / "a.zarr"
    store = Store.create(path, Toy())

    def away(state) -> None:
        if state.done == 0 or not path.exists():
            return
        if how == "removed":
            shutil.rmtree(path)
        else:
            path.rename(tmp_path / "b.zarr")
        if how == "replaced":
            path.mkdir()

    with pytest.raises(AeroflutterError, match=r"a\.zarr: was renamed or removed"):
        run(Toy(), store, Threads(1), away)
    store.close()
    assert not (path / "noise").exists()
    if how != "removed":
        again = Store.resume(tmp_path / "b.zarr", Toy())
        assert (again.done("cells").sum(), again.mended) == (1, ())
        again.close()
