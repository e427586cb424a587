"""Cost of a verdict on chaos, and where chaos is: freeplay, structural damping, runs 100-111.

    python -m benchmarks.bench_chaos [POINTS]

prints, over POINTS (181) speed ratios from 0.1 to 1.0 and six initial pitches, every band in which
some motion is chaotic, with the largest exponent there measured over 20 000 oscillations. Damping
is a tenth of the critical in pitch, in heave, and in both.
"""

from __future__ import annotations

import sys
from collections.abc import Iterator

import numpy as np

from aeroflutter.case import load_case
from aeroflutter.linear.rootlocus import flutter_speed
from aeroflutter.motion.chaos import ChaosOptions, ChaosResult, chaos
from aeroflutter.motion.response import Initial
from benchmarks import Measurement, cpu_seconds

RUNS = ("run100", "run101", "run102", "run103", "run111")
PITCHES_DEG = (-2.0, -0.6, 1.0, 2.0, 3.0, 6.0)
SEARCH = ChaosOptions(cycles=2000)
LONG = ChaosOptions(cycles=20_000)
DAMPING = (("zeta_alpha",), ("zeta_xi",), ("zeta_alpha", "zeta_xi"))


def measure() -> Iterator[Measurement]:
    """CPU time of one verdict in the chaotic band of freeplay."""
    case = load_case("freeplay-02")
    reference = flutter_speed(case.family())
    assert reference is not None
    system, start = case.family().at(0.3 * reference), Initial(alpha=case.initial.alpha)
    for options in (SEARCH, LONG):
        seconds = cpu_seconds(lambda o=options: chaos(system, case.spring, start, o))  # type: ignore[misc]
        yield Measurement(f"verdict with 3 exponents, {options.cycles} oscillations", seconds)


def search(name: str, ratios: np.ndarray, changes: dict[str, float] | None = None) -> None:
    """Print the bands of chaos of a case; ratios refer to the case without the changes."""
    plain = load_case(name)
    reference = flutter_speed(plain.family())
    assert reference is not None
    case = plain.with_overrides({f"section.{key}": value for key, value in (changes or {}).items()})
    best: list[tuple[float, float] | None] = []
    for ratio in ratios:
        system = case.family().at(ratio * reference)
        found = [(_run(case, system, pitch, SEARCH), pitch) for pitch in PITCHES_DEG]
        wild = [(r.exponents.values[0], pitch) for r, pitch in found if r.verdict == "chaotic"]
        best.append(max(wild, default=None))
    inside = np.diff([0, *(one is not None for one in best), 0])
    label = f"{name} {changes or ''}"
    if not inside.any():
        print(f"{label}: no chaos", flush=True)
    for i, j in zip(np.flatnonzero(inside == 1), np.flatnonzero(inside == -1), strict=True):
        k = max(range(i, j), key=lambda k: best[k] or (0.0, 0.0))
        _, pitch = best[k] or (0.0, 0.0)
        system = case.family().at(ratios[k] * reference)
        found = _run(case, system, pitch, LONG)
        starts = sum(
            _run(case, system, other, SEARCH).verdict == "chaotic" for other in PITCHES_DEG
        )
        print(
            f"{label}: {ratios[i]:.5g} to {ratios[j - 1]:.5g}, at {ratios[k]:.5g} from "
            f"{pitch:g} deg {found.name}, {found.exponents.values[0]:.3g} "
            f"± {found.exponents.error[0]:.1g}; {starts} of {len(PITCHES_DEG)} starts are chaotic",
            flush=True,
        )


def _run(case, system, pitch: float, options: ChaosOptions) -> ChaosResult:  # type: ignore[no-untyped-def]
    return chaos(system, case.spring, Initial(alpha=np.radians(pitch)), options)


def main() -> None:
    """The search over all runs, and over damping for freeplay."""
    ratios = np.linspace(0.1, 1.0, int(sys.argv[1]) if len(sys.argv) > 1 else 181)[:-1]
    for name in RUNS:
        search(name, ratios)
    for keys in DAMPING:
        search("freeplay-02", ratios, dict.fromkeys(keys, 0.1))


if __name__ == "__main__":
    main()
