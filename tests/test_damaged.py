"""Stores of which a chunk is nonsense: resumed they are whole, whatever the chunk was of."""

from __future__ import annotations

import shutil
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pytest

from aeroflutter.studies.maps import Store, Threads, run
from aeroflutter.studies.maps.results import MemoryResults
from aeroflutter.studies.maps.study import Task
from tests.test_maps_store import Toy

ARRAYS = ("state", "noise", "edge", "label", "x", "blocks/cells", "blocks/edges_cpu")


@dataclass(frozen=True, eq=False)
class Odd(Toy):
    """The last block is smaller than a chunk, so that zarr reads the chunk to write the block."""

    shape: tuple[int, int] = (5, 30)
    block_shape: tuple[int, int] = (2, 30)

    def tasks(self, phase, results):
        tasks = super().tasks(phase, results)
        part = slice(4, 5)
        return [*tasks[:-1], Task(phase, 2, (part, slice(0, 30)), tasks[-1].given)]

    def compute(self, task):
        rows = task.region[0].stop - task.region[0].start
        noise = np.random.default_rng(task.number).random((rows, 30))
        if task.phase == "edges":
            return {"edge": noise + task.given["state"][task.region]}
        return {"state": (noise > 0.5).astype(np.int8), "noise": noise}


def filled(results):
    run(Odd(), results, Threads(1))
    results.put("label", np.round(results.read("noise")).astype(np.int32))
    return {v.name: np.asarray(results.read(v.name)).tobytes() for v in Odd().variables}


@pytest.fixture(scope="module")
def finished(tmp_path_factory) -> Path:
    path = tmp_path_factory.mktemp("finished") / "a.zarr"
    store = Store.create(path, Odd())
    filled(store)
    store.close()
    return path


@pytest.mark.parametrize("name", ARRAYS)
def test_nonsense_in_every_chunk_of_an_array(finished: Path, tmp_path: Path, name: str) -> None:
    path = Path(shutil.copytree(finished, tmp_path / "a.zarr"))
    chunks = [file for file in (path / name / "c").rglob("*") if file.is_file()]
    assert chunks
    for chunk in chunks:
        chunk.write_bytes(b"nonsense")
    again = Store.resume(path, Odd())
    assert bool(again.mended) == (name != "label")
    assert filled(again) == filled(MemoryResults(Odd()))
    assert np.isfinite(again.cpu_seconds)
    again.close()
