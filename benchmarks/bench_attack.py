"""Attack on the proofs of absence: random sections and springs, motions, cycles, spoiled proofs.

    python -m benchmarks.bench_attack --out attack.jsonl --seconds 3000

goes on where the file ends, case by case, and prints what it holds. Each random case is asked

- whether any of twenty motions from everywhere goes on at a speed that has been certified;
- whether a certificate is issued just above the lowest exact limit cycle;
- whether the checker accepts a certificate in which one number has been changed, although the
  condition, sampled densely by formulas of this file, is then violated;
- whether a saved certificate is read after the last bit of one number has been changed;
- how far below the lowest cycle, or divergence, the highest certified speed lies, of a ladder
  of distances.
"""

from __future__ import annotations

import argparse
import json
import re
import signal
import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import replace
from itertools import pairwise
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np

from aeroflutter import SectionFamily, TypicalSection
from aeroflutter.errors import AeroflutterError, InputError
from aeroflutter.guarantees.absence import Absence, Certificate, absence_at
from aeroflutter.guarantees.absence.certificate import Loop
from aeroflutter.guarantees.absence.checker import Refused, check
from aeroflutter.linear.rootlocus import flutter_speed, root_locus
from aeroflutter.motion.endstates import end_states
from aeroflutter.motion.flow import Flow
from aeroflutter.motion.response import STATES
from aeroflutter.orbits.cycles import CycleOptions, limit_cycles
from aeroflutter.springs import Bilinear, Freeplay, Hysteresis, Spring, Table

MOTIONS, SPOILED, SECONDS, CYCLES = 20, 2, 1.0, 5.0
RANGE, LARGEST = (0.05, 1.02), 20.0  # speeds over flutter, and amplitudes, of cycles looked for
BELOW = (5e-4, 2e-3, 5e-3, 0.01, 0.02, 0.05, 0.1, 0.2, 0.35, 0.5, 0.7, 0.9)
ABOVE = 1.0005
BANDS = (0.0, 0.3, 0.6, np.inf)


def section(rng: np.random.Generator) -> TypicalSection:
    r_alpha = rng.uniform(0.3, 0.8)
    damped = rng.uniform() < 0.7
    return TypicalSection(
        mu=float(10.0 ** rng.uniform(1.0, 2.5)),
        a_h=float(rng.choice([-0.5, rng.uniform(-0.9, 0.3)], p=[0.2, 0.8])),
        x_alpha=float(rng.uniform(0.05, 0.8) * r_alpha),
        r_alpha=float(r_alpha),
        omega_bar=float(rng.uniform(0.1, 1.1)),
        zeta_alpha=float(damped * rng.uniform(0.0, 0.1)),
        zeta_xi=float(damped * rng.uniform(0.0, 0.1)),
    )


def spring(rng: np.random.Generator) -> Spring:
    kind = rng.choice(["loop", "freeplay", "bilinear", "table"], p=[0.7, 0.1, 0.1, 0.1])
    centre = float(rng.choice([0.0, rng.normal()]))
    if kind == "loop":
        ratio = float(10.0 ** rng.uniform(-1.3, 1.3))
        return Hysteresis(ratio, 1.0, centre, float(rng.choice([0.0, rng.normal()])))
    if kind == "freeplay":
        return Freeplay(1.0, centre)
    if kind == "bilinear":
        return Bilinear(float(rng.uniform(0.0, 1.0)), float(rng.uniform(0.0, 0.9)), 0.25, 0.5)
    slopes = np.r_[1.0, rng.uniform(0.1, 1.0, 3), 1.0]
    breaks = np.cumsum(rng.uniform(0.2, 1.0, 6)) - 2.0
    moments = np.r_[0.0, np.cumsum(slopes * np.diff(breaks))]
    return Table(tuple(breaks), tuple(moments - np.interp(0.0, breaks, moments)))


def attacked(number: int) -> dict[str, Any]:
    """What becomes of one random case."""
    rng = np.random.default_rng((19, number))
    family, law = SectionFamily(section(rng)), spring(rng)
    facts: dict[str, Any] = {"number": number, "omega_bar": family.section.omega_bar}
    facts |= {"kind": law.kind, "spring": repr(law), "section": repr(family.section)}
    started = time.process_time()
    flutter = flutter_speed(family)
    if flutter is None:
        return facts | {"skipped": "no flutter"}
    options = CycleOptions(
        points=2, simulations=20, depth=0, largest=LARGEST, speed_ratio_range=RANGE
    )
    lowest = None
    try:
        with at_most(CYCLES):
            found = limit_cycles(family, law, options).onset
        lowest = None if found is None else found.cycle.speed
    except TimeoutError:
        facts["unknown"] = f"lowest cycle: more than {CYCLES:g} s of CPU"
    # Beyond flutter, divergence and the lowest cycle nothing can be proved.
    limit = min(flutter, root_locus(family).divergence or np.inf, lowest or np.inf)
    facts |= {"flutter": flutter, "lowest": lowest, "limit": limit}
    free = nearest(family, law, limit)
    facts["certified"] = None if free is None else free.high
    if free is not None and free.certificate is not None:
        facts["ends"] = motions(family, law, free.high, rng)
        facts["spoiled"] = [outcome(spoiled(free.certificate, rng)) for _ in range(SPOILED)]
        facts["altered"] = altered(free.certificate, rng)
    if lowest is not None and ABOVE * lowest < flutter:
        facts["above"] = absence_at(family, law, ABOVE * lowest, SECONDS).certified
    facts["cpu"] = time.process_time() - started
    return facts


@contextmanager
def at_most(seconds: float) -> Iterator[None]:
    """Raise `TimeoutError` after so many seconds of CPU."""

    def late(*_: object) -> None:
        raise TimeoutError

    signal.signal(signal.SIGPROF, late)
    signal.setitimer(signal.ITIMER_PROF, seconds)
    try:
        yield
    finally:
        signal.setitimer(signal.ITIMER_PROF, 0.0)


def nearest(family: SectionFamily, law: Spring, lowest: float) -> Absence | None:
    """What is certified at the least of some distances below a speed."""
    best, low, high = None, 0, len(BELOW)
    while low < high:
        middle = (low + high) // 2
        free = absence_at(family, law, (1.0 - BELOW[middle]) * lowest, SECONDS)
        if free.certified:
            best, high = free, middle
        else:
            low = middle + 1
    return best


def motions(
    family: SectionFamily, law: Spring, speed: float, rng: np.random.Generator
) -> list[str]:
    """How motions from everywhere end."""
    flow = Flow(family.at(speed), [law])
    n = flow.n
    states = 10.0 ** rng.uniform(-1.0, 1.5, (MOTIONS, 1)) * rng.uniform(-1.0, 1.0, (MOTIONS, n))
    states *= law.scale
    y = states @ family.c
    memory = [float(law.advance(rng.uniform(-0.5, 0.5), one)) for one in y]
    return [STATES[one] for one in end_states(flow, states, np.array(memory)).state]


def spoiled(certificate: Certificate, rng: np.random.Generator) -> Certificate:
    """One number of the proof changed."""
    (piece,) = certificate.pieces
    factor = float(rng.choice([-1.0, 0.0, 0.5, 1.5, 1.0 + rng.normal(0.0, 0.1)]))
    which = rng.integers(0, 4 if piece.terms else 2)
    if which == 0:
        changed = replace(piece, lam=piece.lam * factor)
    elif which == 1:
        changed = replace(piece, low=abs(factor) * piece.low, high=abs(factor) * piece.high)
    else:
        terms = [list(term) for term in piece.terms]
        weights = np.abs([c for _, c in piece.terms])
        chosen = rng.choice(len(terms), p=weights / weights.sum())
        terms[chosen][which - 2] *= factor
        changed = replace(piece, terms=tuple(map(tuple, terms)))
    return replace(certificate, pieces=(changed,))


def altered(certificate: Certificate, rng: np.random.Generator) -> str:
    """Whether a saved certificate of which one number has been changed is read."""
    with TemporaryDirectory() as folder:
        path = Path(folder) / "proof.json"
        certificate.save(path)
        text = path.read_text(encoding="utf-8")
        numbers = [*re.finditer(r"(?<=[\[ ])-?[0-9][0-9.e+-]*(?=[,\n])", text)]
        one = numbers[rng.integers(len(numbers))]
        other = repr(float(np.nextafter(float(one[0]), rng.choice([-np.inf, np.inf]))))
        path.write_text(text[: one.start()] + other + text[one.end() :], encoding="utf-8")
        try:
            Certificate.load(path)
        except InputError:
            return "refused"
    return "read"


def outcome(certificate: Certificate) -> str:
    """refused, harmless (accepted, and true as far as samples go), or WRONG."""
    try:
        check(certificate, 20_000)
    except Refused:
        return "refused"
    return "harmless" if holds(certificate) else "WRONG"


def holds(certificate: Certificate) -> bool:
    """The condition at many frequencies, and the others, by formulas of their own."""
    (piece,), model, law = certificate.pieces, certificate.model, certificate.spring
    v = 1.0 / piece.high
    A = sum(np.array(one) * v**k for k, one in enumerate(model.A))
    b = sum(np.array(one) * v**k for k, one in enumerate(model.b))
    c = np.array(model.c)
    p, q = (0.0, 1.0) if isinstance(law, Loop) else (law.low, law.high)
    roots = np.linalg.eigvals(A - q * np.outer(b, c))
    longest = max([abs(t) for t, _ in piece.terms], default=1.0)
    omega = np.concatenate(
        [np.linspace(1e-6, 8.0, int(400 * longest)), np.geomspace(1e-6, 100.0, 4000)]
        + [abs(r.imag) + r.real * np.linspace(-20.0, 20.0, 4001) for r in roots]
    )
    omega = omega[omega > 0.0]
    values, vectors = np.linalg.eig(A - q * np.outer(b, c))
    residues = (c @ vectors) * np.linalg.solve(vectors, b)
    H = (q - p) * (residues / (1j * omega[:, None] - values)).sum(axis=1)
    F = piece.w * H.imag / omega + piece.lam * (H.real - 1.0)
    for t, one in piece.terms:
        if isinstance(law, Loop):
            F -= one * np.sin(omega * t) / omega
        else:
            F += one * ((1.0 - np.exp(1j * omega * t)) / omega**2 * (H - 1.0)).real
    good = roots.real.max() < 0.0 and F.max() < 0.0 and piece.lam >= 0.0
    if isinstance(law, Loop):
        total = sum(abs(one) for _, one in piece.terms)
        return bool(good and law.delta_h * total < law.delta_v)
    return bool(good and all(one >= 0.0 for _, one in piece.terms))


def summary(cases: list[dict[str, Any]]) -> Iterator[tuple[str, float, str, float | None]]:
    asked = [one for one in cases if one.get("certified")]
    yield "cases", len(cases), "", None
    yield "with flutter and a certified speed", len(asked), "", None
    yield "lowest cycle not found in time", sum("unknown" in one for one in cases), "", None
    yield "failed to be computed", sum("failed" in one for one in cases), "", None
    ends = [end for one in asked for end in one["ends"]]
    yield "motions at certified speeds", len(ends), "", None
    yield "of them not at rest in the end", sum(end != "damped" for end in ends), "", 0.0
    yield "certified above an exact cycle", sum(bool(one.get("above")) for one in asked), "", 0.0
    yield "asked above one", sum("above" in one for one in asked), "", None
    spoils = [end for one in asked for end in one["spoiled"]]
    yield "spoiled certificates", len(spoils), "", None
    yield "of them accepted and still true", spoils.count("harmless"), "", None
    yield "of them accepted and false", spoils.count("WRONG"), "", 0.0
    pairs = [(one["omega_bar"], one["certified"] / one["limit"]) for one in asked if one["lowest"]]
    omega, ratio = np.array(pairs).reshape(-1, 2).T
    yield "certified at or above the lowest cycle", float((ratio >= 1.0).sum()), "", 0.0
    for low, high in pairwise(BANDS):
        here = ratio[(omega >= low) & (omega < high)]
        if here.size:
            yield f"omega_bar from {low:g} to {high:g}: cases", here.size, "", None
            for part in (0.5, 0.25, 0.05, 0.0):
                yield (
                    f"    bound over lowest cycle or divergence, quantile {part:g}",
                    float(np.quantile(here, part)),
                    "",
                    None,
                )
    yield "CPU a case", float(np.mean([one["cpu"] for one in asked])), "s", None


def collect(path: Path | None, count: int, seconds: float) -> list[dict[str, Any]]:
    cases: list[dict[str, Any]] = []
    if path is not None and path.exists():
        cases = [json.loads(line) for line in path.read_text(encoding="utf-8").splitlines()]
    begun = time.process_time()
    for number in range(len(cases), count):
        if time.process_time() - begun > seconds:
            break
        try:
            case = attacked(number)
        except AeroflutterError as error:
            case = {"number": number, "failed": str(error)}
        cases.append(case)
        if path is not None:
            with path.open("a", encoding="utf-8") as file:
                file.write(json.dumps(case) + "\n")
    return cases


def measure() -> Iterator[tuple[str, float, str, float | None]]:
    yield from summary(collect(None, 1000, 120.0))


if __name__ == "__main__":
    parser = argparse.ArgumentParser()
    parser.add_argument("--out", type=Path, required=True)
    parser.add_argument("--cases", type=int, default=1000)
    parser.add_argument("--seconds", type=float, default=3000.0)
    given = parser.parse_args()
    for what, value, unit, _ in summary(collect(given.out, given.cases, given.seconds)):
        print(f"{what:<58}{value:>10.4g} {unit}")
    sys.exit(0)
