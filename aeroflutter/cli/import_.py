"""`aeroflutter import`."""

from __future__ import annotations

import os
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

from cyclopts import Parameter

from aeroflutter.cli.common import say, target_problems
from aeroflutter.errors import InputError

if TYPE_CHECKING:
    from aeroflutter.case import Case
    from aeroflutter.linear.pk import PKResult
    from aeroflutter.model.elsewhere.modal import ModalModel

CLOSE = 1.5e-3  # relative distance of crossings that is close enough
LAGS = (3, 4, 5, 6, 7, 8, 10)
LITTLE = 0.02  # damping ratio below which the frequency of a mode is compared
NONE = 1e-9  # damping ratio that is round-off
REACH = 2.0  # flutter speeds that are searched
MOST = 12  # crossings at which the approximation is drawn to the table


def import_(
    files: Annotated[
        list[Path],
        Parameter(help="npz, mat, nc, h5 or op4; of a state space also several, one a speed."),
    ],
    /,
    *,
    out: Annotated[Path, Parameter(name="--out", help="Case file that is written (.toml).")],
    set: Annotated[
        list[str],
        Parameter(
            name="--set",
            negative=(),
            show_default=False,
            help="A key of [model] that the file does not say, as in --set semichord=2.0.",
        ),
    ] = [],  # noqa: B006  # read only
    overwrite: Annotated[
        bool, Parameter(negative=(), show_default=False, help="Replace a file that exists.")
    ] = False,
) -> None:
    """Write a case file for a state space or a modal model of another program.

    Of a modal model the rational approximation is chosen by the p-k method: as few lag roots as
    bring its crossings to those of the table.
    """
    from aeroflutter.case import load_case
    from aeroflutter.files import replacing

    _refuse(out, overwrite)
    table = _table(files, out, set)
    case = load_case({"model": _absolute(table, out)})
    modal = None if case.imported is None else case.imported.modal
    said: list[str] = []
    if modal is not None and not {"lags", "exact", "emphasis", "method"} & {*table}:
        table |= _approximated(modal, said)
        case = load_case({"model": _absolute(table, out)})
    with replacing(out) as part:
        part.write_text(_text(case, table, said), encoding="utf-8")
    assert case.imported is not None
    for line in (*said, *case.imported.notes):
        say(line)
    say(f"written: {out}")


def _refuse(output: Path, overwrite: bool) -> None:
    problems = target_problems("--out", output, (".toml",))
    if not problems and output.exists() and not overwrite:
        problems = [f"--out {output}: exists; give another name, or --overwrite to replace it"]
    if problems:
        raise InputError(problems)


def _table(files: list[Path], output: Path, changes: list[str]) -> dict[str, Any]:
    """Keys of [model] from the kind of file and what is said beside it."""
    from aeroflutter.case.source import parse_override
    from aeroflutter.model.elsewhere.variables import read_variables

    said = dict(map(parse_override, changes))
    said = {name.removeprefix("model."): value for name, value in said.items()}
    folder = output.parent.resolve()
    names = [_beside(file, folder) for file in files]
    if "kind" not in said:
        stored = read_variables(files[0])
        name = said.get("Q", "Q")  # of the forces, if it is not they themselves
        forces = not isinstance(name, str) or name in stored or "QHH" in stored
        if not forces and "A" not in stored:
            held = ", ".join(name for name in stored if name.isprintable())[:120]
            raise InputError(
                f"{files[0].name}: holds neither A, B, C nor M, K, Q, k; it holds {held}"
            )
        said["kind"] = "modal" if forces else "state-space"
    return {"kind": said.pop("kind"), "file": names if len(names) > 1 else names[0], **said}


def _beside(file: Path, folder: Path) -> str:
    """The path of a file as a case in a folder names it."""
    try:
        return os.path.relpath(file.resolve(), folder)
    except ValueError:  # another drive
        return str(file.resolve())


def _absolute(table: dict[str, Any], output: Path) -> dict[str, Any]:
    folder = output.parent.resolve()
    file = table["file"]
    whole = [str(folder / one) for one in file] if isinstance(file, list) else str(folder / file)
    return table | {"file": whole}


def _approximated(modal: ModalModel, said: list[str]) -> dict[str, Any]:
    """Keys of the approximation whose crossings are nearest to those of the table."""
    from aeroflutter.linear.pk import PKOptions, pk_method
    from aeroflutter.linear.rootlocus import RootLocusOptions, root_locus
    from aeroflutter.model.elsewhere.modal import ModalModel
    from aeroflutter.model.elsewhere.rational import FitOptions

    whole = modal.whole()
    low, high = modal.search_range
    found = pk_method(whole, PKOptions(low=low, high=high))
    if found.flutter is not None and modal.speed_range is None:
        high = min(high, max(REACH * found.flutter.speed, 1.01 * low))
    crossings = [one for one in found.crossings if one.speed <= high][:MOST]
    forces = modal.modes.forces
    steady = [0.0] if forces.k[0] <= 0.05 * forces.k[-1] else []
    emphasis = [float(f"{one.k:.6g}") for one in crossings]
    best: tuple[float, int] | None = None
    for lags in LAGS:
        if 2 * len(forces.k) < 3 + lags:
            break
        options = FitOptions(lags=lags, exact=steady, emphasis=emphasis)
        try:
            model = ModalModel(
                modes=modal.modes, rows=modal.rows, stiffness=modal.stiffness,
                in_stiffness=modal.held, approximation=options, speed_range=(low, high),
            )  # fmt: skip
        except InputError:
            continue  # these lags make the mass of the air too large
        others = root_locus(
            _closed(model), RootLocusOptions(low=low, high=high, grid=120)
        ).crossings
        distance = max(_distance(crossings, others), _detuned(found, model, high))
        if best is None or distance < best[0]:
            best = (distance, lags)
        if distance < CLOSE:
            break
    if best is None:
        raise InputError("Q: no approximation leaves the mass positive definite; give lags")
    worst, lags = best
    if crossings:
        first = crossings[0]
        said.append(
            f"p-k crosses first at {first.speed:.5g} m/s, k = {first.k:.4g}; crossings, and the "
            f"frequencies of modes of little damping, are met within {worst:.2%} up to "
            f"{high:.4g} m/s by {lags} lag roots"
        )
    keys = {"lags": lags, "exact": steady, "emphasis": emphasis}
    return {**keys, "speed_range": [float(f"{one:.6g}") for one in (low, high)]}


def _closed(model: ModalModel) -> Any:
    from aeroflutter.model.elsewhere.placed import PlacedModel

    return PlacedModel(model, model.names[:1])


def _distance(wanted: list[Any], found: tuple[Any, ...]) -> float:
    """Largest relative distance of a crossing from the one that it is to be; 1 for one too many."""
    left = list(found)
    worst = 0.0
    for one in wanted:
        alike = [other for other in left if other.growing == one.growing]
        if not alike:
            return 1.0
        near = min(alike, key=lambda o: abs(o.speed / one.speed - 1) + abs(o.k / one.k - 1))
        left.remove(near)
        worst = max(worst, abs(near.speed / one.speed - 1))
    return worst if not left else max(worst, 0.999)


def _detuned(found: PKResult, model: ModalModel, high: float) -> float:
    """Largest relative error of the frequency of a mode of little damping."""
    import numpy as np

    below = found.speeds <= high
    speeds, wanted = found.speeds[below], found.roots[below]
    A, B, C, _ = _closed(model).stack(speeds)
    roots = np.linalg.eigvals(A - B @ C) * (speeds / found.semichord)[:, None]
    nearest = np.argmin(np.abs(wanted[:, :, None] - roots[:, None, :]), axis=2)
    ours = np.take_along_axis(roots, nearest, axis=1)
    damping = np.abs(wanted.real) / np.abs(wanted)
    light = (damping < LITTLE) & (damping > NONE)  # what no air touches is no state
    error = np.abs(ours.imag / wanted.imag - 1)
    return float(np.max(error[light], initial=0.0))


def _text(case: Case, table: dict[str, Any], said: list[str]) -> str:
    """The case with what is worth knowing as comments."""
    from aeroflutter.case.source import dump_case

    assert case.imported is not None
    notes = [f"# {line}" for line in (*said, *case.imported.notes)]
    first, *_ = case.imported.places.items()
    gap = "gap_deg = 1.0" if first[1] == "rad" else "gap = 0.01"
    places = ", ".join(f'"{name}"' for name in case.imported.places)
    return "\n".join(
        [
            *notes,
            dump_case({"model": table}).rstrip(),
            "",
            f"# springs stand at {places}; those without an entry are linear",
            "# [[spring]]",
            f'# at = "{first[0]}"',
            '# kind = "freeplay"',
            f"# {gap}",
            "",
        ]
    )
