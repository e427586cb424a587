"""Loops with memory beside polynomials: motions, Jacobians, cycles, exponents, maps."""

from __future__ import annotations

import numpy as np
import oracle_mixed as oracle
import pytest
from oracle_springs import section

from aeroflutter import Cubic, Hysteresis, Play, Polynomial, System
from aeroflutter.motion import Initial, SimulateOptions, simulate
from aeroflutter.motion.chaos.smooth_window import passage
from aeroflutter.motion.smooth_laws import SmoothLoop

KINDS = ("hysteresis", "play"), ("cubic", "polynomial")


def case(seed):
    """A random section, or one whose two springs are in pitch; springs, their oracle's, a start."""
    rng = np.random.default_rng((17, seed))
    speed = rng.uniform(1.5, 5.0)
    A, B, C, d = section(rng, speed)
    if seed % 5 == 4:
        B, C = np.column_stack((B[:, 0], B[:, 1], 0.4 * B[:, 1])), C[[0, 1, 1]]
    laws = [random_law(rng, KINDS[0][seed % 2]), random_law(rng, KINDS[1][seed // 2 % 2])]
    if len(C) == 3:
        laws.append(random_law(rng, KINDS[0][seed // 3 % 2]))
    else:
        laws = laws[:: rng.choice([1, -1])]
    x = rng.normal(size=6) * np.array([1, 1, 0.2, 0.2, 0, 0])
    memory = rng.uniform(-0.3, 0.3, len(laws))
    springs, others = zip(*laws, strict=True)
    return (A, B, C, d), springs, others, x, memory, 30 * speed


def random_law(rng, kind):
    if kind == "hysteresis":
        v, h, v_off, h_off = rng.uniform([0.1, 0.2, -0.3, -0.3], [0.8, 1.0, 0.3, 0.3])
        loop = oracle.Slider(v_off + v / 2, v_off - v / 2, h_off - h / 2, h_off + h / 2)
        return Hysteresis(v, h, v_off, h_off), loop
    if kind == "play":
        width = rng.uniform(0.2, 0.8)
        return Play(width), oracle.Slider(width / 2, -width / 2, play=True)
    beta = tuple(rng.uniform([0.2, 0.0, 0.1], [1.0, 0.0 if kind == "cubic" else 0.3, 1.0]))
    return (Cubic(beta[0], beta[2]) if kind == "cubic" else Polynomial(beta)), oracle.Power(beta)


def compare(seed):
    """Largest difference from DOP853 over growth and size, and the number of switches."""
    system, springs, others, x, memory, time = case(seed)
    end, held, switches = oracle.march(system, others, x, memory, time)
    options = SimulateOptions(duration=time, decide=False, record=False)
    run = simulate(System(*system), springs, Initial(state=x, memory=memory), options)
    assert run.engine == "smooth"
    loop = SmoothLoop.of(System(*system), springs)
    found = passage(loop, loop.point(x, memory), time)
    growth = max(1.0, np.linalg.norm(found.jacobian, 2))
    size = max(1.0, np.abs(end).max())
    away = [
        np.abs(run.final_state - end).max(),
        np.abs(run.final_memory - held)[loop.held].max(),
        np.abs(found.end - np.append(end, held[loop.held])).max(),
    ]
    return max(away) / (growth * size), switches


@pytest.mark.parametrize("seed", [0, 1, 4, 9])
def test_motions_are_those_of_dop853_with_events(seed):
    away, switches = compare(seed)
    assert switches > 4
    assert away < 1e-8
