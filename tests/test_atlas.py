"""Tables between Chebyshev's points, against tables made at the speed itself."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from aeroflutter import Hysteresis, SectionFamily, TypicalSection
from aeroflutter.motion import atlas as module
from aeroflutter.motion.atlas import REPAYS, STRETCH, Atlas
from aeroflutter.motion.flow import Flow
from aeroflutter.motion.step_tables import balance, build
from aeroflutter.orbits.cycles.loop import Loop

FAMILY = SectionFamily(TypicalSection(omega_bar=0.8, zeta_alpha=0.01))
SPRING = Hysteresis(1.0, 0.2)
SPEEDS = 3.9 * np.exp(0.8 * STRETCH * np.linspace(0.0, 1.0, 23))


def kinked(speed: float) -> tuple[np.ndarray, np.ndarray]:
    """Generators of a family whose damping has a corner at 3.95, as that of a table has."""
    A, b = FAMILY.stack(speed)
    dA, db = FAMILY.derivative(speed)
    slope = -0.01 * (speed > 3.95)
    A[2, 2] += slope * (speed - 3.95)
    dA[2, 2] += slope
    return np.column_stack((A, b))[None], np.column_stack((dA, db))[None]


def worst(atlas: Atlas, made: Any, C: np.ndarray) -> float:
    """Largest error of the flow at its own step, over round-off in balanced coordinates."""
    error = 0.0
    for speed in SPEEDS:
        generators, changes = made(speed)
        found = atlas.tables(speed, generators, changes)
        exact = build(generators, C, found.step, changes)
        assert np.array_equal(exact.step, found.step)
        for k, generator in enumerate(generators):
            own = balance(generator[:, :6])
            weights = np.append(own, 1.0) / own[:, None]
            for name in ("flow", "d_flow"):
                one = getattr(found, name)[k].reshape(-1, *generator.shape) * weights
                other = getattr(exact, name)[k].reshape(-1, *generator.shape) * weights
                error = max(error, float(np.max(np.abs(one - other)) / np.max(np.abs(other))))
    return error / 2.0**-53


def test_tables_between_the_nodes_are_as_good_as_those_made_there() -> None:
    loop = Loop(FAMILY, SPRING)
    atlas = Atlas(loop._generators, loop.C)
    assert worst(atlas, loop._generators, loop.C) < 100
    kept = [stretch for stretch in atlas._known.values() if stretch is not None]
    assert len(kept) == len(atlas._known) == 1
    flow = loop.at(float(SPEEDS[-1])).exact
    own = Flow(FAMILY.at(float(SPEEDS[-1])), [SPRING])
    end, wanted = flow.passage(np.arange(7.0), 30.0), own.passage(np.arange(7.0), 30.0)
    assert end.end == pytest.approx(wanted.end, rel=1e-11, abs=1e-11)


def test_a_family_with_a_corner_has_its_tables_made_speed_by_speed() -> None:
    C = Loop(FAMILY, SPRING).C
    atlas = Atlas(kinked, C)
    assert worst(atlas, kinked, C) < 100
    assert None in atlas._known.values()


def test_nodes_are_made_where_they_repay(monkeypatch: pytest.MonkeyPatch) -> None:
    loop = Loop(FAMILY, SPRING)
    atlas = Atlas(loop._generators, loop.C)
    for count in range(REPAYS - 1):
        atlas.tables(3.9 + 1e-3 * count, *loop._generators(3.9))
    assert not atlas._known
    monkeypatch.setattr(module, "LARGEST", 100)
    atlas.tables(3.9, *loop._generators(3.9))
    assert list(atlas._known.values()) == [None]


def test_many_states_have_their_flow_over_several_steps() -> None:
    """They are powers of that over one, and are not interpolated: they change so much faster."""
    rng = np.random.default_rng(5)
    A = rng.normal(size=(2, 17, 17)) - 5.0 * np.eye(17)
    b, C = rng.normal(size=(17, 1)), np.eye(1, 17)

    def made(speed: float) -> tuple[np.ndarray, np.ndarray]:
        whole = np.concatenate((A[0] + speed * A[1], b), axis=1)[None]
        return whole, np.concatenate((A[1], 0 * b), axis=1)[None]

    atlas = Atlas(made, C)
    for speed in 1.0 + 1e-3 * np.arange(REPAYS + 1):
        found = atlas.tables(speed, *made(speed))
    (stretch,) = atlas._known.values()
    assert stretch is not None
    exact = build(made(speed)[0], C, found.step, made(speed)[1])
    assert found.flow.shape == exact.flow.shape
    assert found.flow == pytest.approx(exact.flow, rel=1e-10, abs=1e-12)
    assert found.d_flow == pytest.approx(exact.d_flow, rel=1e-9, abs=1e-10)
