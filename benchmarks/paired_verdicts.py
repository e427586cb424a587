"""Analyses of one spring of two checkouts in turn: CPU time, and how many cells stay undecided.

    python -m benchmarks.paired_verdicts BEFORE AFTER [ROUNDS]

BEFORE and AFTER are folders of checkouts, each with its `.venv`. In each round both do the same
work, one after the other, in processes of their own; the best round of each counts, compilation
left out.
"""

from __future__ import annotations

import json
import subprocess
import sys
from pathlib import Path

WORK = """
import json, time
import numpy as np
from aeroflutter import Freeplay, Hysteresis, SectionFamily, TypicalSection
try:
    from aeroflutter.linear.rootlocus import flutter_speed
    from aeroflutter.model.aerodynamics import QuasiSteady
    from aeroflutter.motion.response import Initial, SimulateOptions, simulate
    from aeroflutter.orbits.cycles import limit_cycles
    from aeroflutter.orbits.describing import describing_curve
    from aeroflutter.orbits.harmonic import harmonic_balance
    from aeroflutter.studies.maps import Axis, Grid, SpeedPitch, flutter_map
except ImportError:
    from aeroflutter import QuasiSteady
    from aeroflutter.cycles import limit_cycles
    from aeroflutter.describing import describing_curve
    from aeroflutter.harmonic import harmonic_balance
    from aeroflutter.timemarch import Initial, SimulateOptions, simulate
    from aeroflutter.maps import Axis, Grid, SpeedPitch, flutter_map
    from aeroflutter.rootlocus import flutter_speed

degree, found = np.pi / 180, {}
for name, bar, dv, dh, low in (("run 14", 0.8, 1.0, 0.2, 0.85), ("run 102", 0.2, 0.4, 1.0, 0.45)):
    family = SectionFamily(TypicalSection(omega_bar=bar))
    spring, flutter = Hysteresis(dv * degree, dh * degree), flutter_speed(family)
    grid = Grid(Axis("speed_ratio", np.linspace(low, 0.999, 40)),
                Axis("initial.alpha_deg", np.linspace(1.0, 15.0, 25)))
    square = Grid(Axis("speed_ratio", np.linspace(low, 0.999, 60)),
                  Axis("initial.alpha_deg", np.linspace(1.0, 15.0, 60)))
    for of, size in ((grid, "40 x 25"), (square, "60 x 60")):
        cells, cost, count = SpeedPitch(family, spring, of, flutter), [], 0
        for _ in range(4):
            done = flutter_map(cells)
            cost.append(1e6 * done.cpu_seconds / done.state.size)
            count = done.count("undecided")
        found[f"{size} map of {name}: a cell, us"] = min(cost)
        found[f"{size} map of {name}: undecided"] = count
    options = SimulateOptions(record=False)
    marches = [(family.at(r * flutter), Initial(alpha=a * degree))
               for r in np.linspace(low, 0.99, 10) for a in (2.0, 5.0, 9.0)]
    cost = []
    for _ in range(4):
        begin = time.process_time()
        for system, start in marches:
            simulate(system, spring, start, options)
        cost.append(1e3 * (time.process_time() - begin) / len(marches))
    found[f"march of {name}, ms"] = min(cost)
    cost = []
    for _ in range(3):
        begin = time.process_time()
        simulate(*[marches[20][0]], spring, marches[20][1],
                 SimulateOptions(engine="houbolt", record=False, duration=5000.0, decide=False))
        cost.append(1e3 * (time.process_time() - begin))
    found[f"Houbolt of {name}, 50 000 steps, ms"] = min(cost)
    for analysis in (describing_curve, harmonic_balance, limit_cycles):
        analysis(family, spring)
        cost = []
        for _ in range(2):
            begin = time.process_time()
            analysis(family, spring)
            cost.append(time.process_time() - begin)
        found[f"{analysis.__name__} of {name}, s"] = min(cost)
light = SectionFamily(TypicalSection(omega_bar=0.8, zeta_alpha=0.001, zeta_xi=0.001), QuasiSteady())
speed, ends = 0.3 * flutter_speed(light), []
begin = time.process_time()
for a in np.linspace(0.5, 6.0, 12):
    ends.append(simulate(light.at(speed), Freeplay(0.2 * degree), Initial(alpha=a * degree),
                         SimulateOptions(record=False)).state)
found["slow decays: a march, ms"] = 1e3 * (time.process_time() - begin) / 12
found["slow decays: not damped, of 12"] = sum(end != "damped" for end in ends)
print(json.dumps(found))
"""


def measured(folder: Path) -> dict[str, float]:
    """One round of one checkout."""
    words = [folder / ".venv" / "bin" / "python", "-c", WORK]
    done = subprocess.run(words, cwd=folder, check=True, capture_output=True, text=True)
    return dict(json.loads(done.stdout.splitlines()[-1]))


def main(before: str, after: str, rounds: str = "3") -> None:
    """Both in turn."""
    sides = [Path(before).resolve(), Path(after).resolve()]
    found = [[measured(side) for side in sides] for _ in range(int(rounds))]
    for name in found[0][0]:
        old, new = (min(pair[side][name] for pair in found) for side in (0, 1))
        print(f"{name:<42}{old:>10.4g}{new:>10.4g}")


if __name__ == "__main__":
    main(*sys.argv[1:])
