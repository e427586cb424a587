"""What a store looks like on the disk: its arrays, its coordinates, and their repair.

All of it follows from the study, so that whatever is damaged but the results themselves can be
written anew.
"""

from __future__ import annotations

import os
from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from aeroflutter.studies.maps.ownership import COPY, MARK, mark_of
from aeroflutter.studies.maps.results import shape_of
from aeroflutter.studies.maps.study import Region, Study

if TYPE_CHECKING:
    import zarr

__all__ = ["BROKEN", "FORMAT", "blocks_of", "chunk_of", "every_file", "lay_out", "mended"]

FORMAT = 1

BROKEN = (OSError, ValueError, KeyError, TypeError, AttributeError, RuntimeError)
"""What zarr raises for files that it cannot make sense of."""


def lay_out(path: Path, study: Study) -> zarr.Group:
    """The empty arrays, the coordinates, and the attribute that makes the store ours, twice."""
    import zarr

    group = zarr.open_group(path, mode="a", zarr_format=3)
    group.attrs.update({MARK: _mark(study)})
    group.create_group(COPY).attrs.update({MARK: _mark(study)})
    for name in _arrays(study):
        _create(group, study, name)
    return group


def mended(path: Path, study: Study) -> tuple[zarr.Group, list[str]]:
    """The group of a store, and a line for each part that was damaged and is written anew.

    Results are not looked at here: an array whose description was lost keeps its chunks, and
    their checksums decide.
    """
    import zarr

    lines: list[str] = []
    for folder in (path, path / COPY):
        if not _has_mark(folder):
            mark = mark_of(path) or _mark(study)
            (folder / "zarr.json").unlink(missing_ok=True)
            zarr.open_group(folder, mode="a", zarr_format=3).attrs.update({MARK: mark})
            if folder == path:
                lines.append("its own description was damaged; it is written anew")
    group = zarr.open_group(path, mode="r+", zarr_format=3)
    for name in _arrays(study):
        try:
            whole = _whole(group[name], study, name)
        except BROKEN:
            whole = False
        if not whole:
            (path / name / "zarr.json").unlink(missing_ok=True)
            _create(group, study, name)
            lines.append(f"{name} was damaged; its description is written anew")
    return group, lines


def _has_mark(folder: Path) -> bool:
    """Whether a group can be opened and says itself whose it is."""
    import zarr

    try:
        mark: Any = zarr.open_group(folder, mode="r", zarr_format=3).attrs[MARK]
        return isinstance(mark["identity"], dict) and isinstance(mark["failures"], list)
    except BROKEN:
        return False


def _mark(study: Study) -> dict[str, Any]:
    arrays = [*study.dimensions, *(v.name for v in study.variables)]
    return {"format": FORMAT, "identity": study.identity(), "failures": [], "arrays": arrays}


def _arrays(study: Study) -> dict[str, dict[str, Any]]:
    """Every array by its path in the store: how it is created."""
    shape, names = shape_of(study), list(study.dimensions)
    arrays: dict[str, dict[str, Any]] = {}
    for name, values in study.dimensions.items():
        arrays[name] = {
            "shape": values.shape,
            "chunks": values.shape,
            "dtype": values.dtype,
            "dimension_names": [name],
        }
    for variable in study.variables:
        arrays[variable.name] = {
            "shape": shape,
            "chunks": study.block_shape,
            "dtype": np.dtype(variable.dtype),
            "fill_value": variable.fill,
            "dimension_names": names,
        }
    count = sum(1 for _ in blocks_of(study))
    for phase in study.phases:
        one = {"chunks": (1, 32), "dtype": np.dtype("u1"), "fill_value": 0}
        arrays[f"{COPY}/{phase}"] = {"shape": (count, 32), **one}
        one = {"chunks": (1,), "dtype": np.dtype("f8"), "fill_value": np.nan}
        arrays[f"{COPY}/{phase}_cpu"] = {"shape": (count,), **one}
    return arrays


def _create(group: zarr.Group, study: Study, name: str) -> None:
    array = group.create_array(name, **_arrays(study)[name])
    if name in study.dimensions:
        array[:] = study.dimensions[name]


def _whole(array: Any, study: Study, name: str) -> bool:
    """Whether an array is as it was created, and a coordinate holds what it should."""
    wanted = _arrays(study)[name]
    if array.shape != tuple(wanted["shape"]) or array.dtype != wanted["dtype"]:
        return False
    if tuple(array.chunks) != tuple(wanted["chunks"]):
        return False
    if array.metadata.dimension_names != _tuple(wanted.get("dimension_names")):
        return False
    return name not in study.dimensions or np.array_equal(array[:], study.dimensions[name])


def _tuple(names: list[str] | None) -> tuple[str, ...] | None:
    return None if names is None else tuple(names)


def blocks_of(study: Study) -> Iterator[Region]:
    """Regions of the blocks in the order of their numbers."""
    shape, block = shape_of(study), study.block_shape
    starts = [range(0, n, b) for n, b in zip(shape, block, strict=True)]
    for index in np.ndindex(*map(len, starts)):
        yield tuple(
            slice(starts[d][i], min(starts[d][i] + block[d], shape[d])) for d, i in enumerate(index)
        )


def chunk_of(study: Study, region: Region) -> list[int]:
    """Numbers of the chunk that a block is."""
    return [part.start // size for part, size in zip(region, study.block_shape, strict=True)]


def every_file(path: Path) -> Iterator[Path]:
    """The files and folders of a store."""
    for folder, _, names in os.walk(path):
        yield from (Path(folder, name) for name in names)
        yield Path(folder)
