"""The p-k method and the modal family: the BAH wing of Nastran, and a section in closed form."""

import bah
import numpy as np
import pytest

from aeroflutter.errors import InputError
from aeroflutter.linear.pk import PKOptions, pk_method
from aeroflutter.linear.rootlocus import RootLocusOptions, root_locus
from aeroflutter.model.elsewhere.forces import TabulatedForces
from aeroflutter.model.elsewhere.modal import ModalModel, Modes
from aeroflutter.model.elsewhere.rational import FitOptions

HZ = 2 * np.pi


def springs_in_a_mode(modes, **options):
    row = np.zeros(10)
    row[3] = 1.0
    return ModalModel(
        modes=modes, rows=[row], stiffness=[modes.K[3, 3]], speed_range=(60.0, 700.0), **options
    )


def test_the_bah_wing_flutters_where_nastran_says():
    """394.0 m/s and 3.178 Hz as Nastran prints them; interpolation of Q is all that differs."""
    result = pk_method(bah.modes(), PKOptions(low=60.0, high=700.0, points=101))
    assert result.flutter is not None
    assert result.flutter.speed == pytest.approx(394.0, rel=1e-3)
    hertz = result.flutter.k * result.flutter.speed / 2.0 / HZ
    assert hertz == pytest.approx(3.178, rel=1e-3)
    # the mode in plane at 8.7026 Hz has no air force and crosses nowhere, nor does the last
    still = [crossing.k * crossing.speed / 2.0 / HZ for crossing in result.crossings]
    assert all(abs(one - 8.7026) > 0.01 and abs(one - 56.557) > 0.01 for one in still)
    column = np.nanargmin(np.abs(result.frequency_hz[0] - 8.7026))
    np.testing.assert_allclose(result.frequency_hz[:, column], 8.7026, atol=1e-4)
    np.testing.assert_allclose(result.damping[:, column], 0.0, atol=1e-12)


def test_the_approximation_crosses_where_the_table_does():
    modes = bah.modes()
    expected = pk_method(modes, PKOptions(low=60.0, high=700.0, points=101))
    near = tuple(crossing.k for crossing in expected.crossings)
    model = springs_in_a_mode(modes, approximation=FitOptions(lags=6, emphasis=near))
    found = root_locus(model, RootLocusOptions(grid=60)).crossings
    assert len(found) == len(expected.crossings) == 5
    for ours, theirs in zip(found, expected.crossings, strict=True):
        assert ours.growing == theirs.growing
        assert ours.speed == pytest.approx(theirs.speed, rel=2e-3)
        assert ours.k * ours.speed == pytest.approx(theirs.k * theirs.speed, rel=2e-3)


def one_mode(damping):
    """A mass on a spring in air of constant Q = -r + i k d: roots of a quadratic in closed form."""
    k = np.array([0.0, 0.1, 0.5, 1.0, 2.0, 4.0])
    Q = (-0.4 + 1j * k * damping)[:, None, None]
    forces = TabulatedForces(k, Q)
    return Modes(
        mass=[2.0], stiffness=[50.0], damping=[0.6], forces=forces, semichord=0.5, density=1.2
    )


def test_one_mode_in_closed_form():
    modes = one_mode(0.3)
    result = pk_method(modes, PKOptions(low=1.0, high=20.0, points=9))
    # M l^2 + C l + K + ½ρV²(0.4 - i k 0.3) = 0 with k = b w/V; real: growth; at the crossing
    # C w = ½ρV 0.3 b w, so V = 2 C/(0.3 ρ b)
    V = 2 * 0.6 / (0.3 * 1.2 * 0.5)
    assert len(result.crossings) == 1
    crossing = result.crossings[0]
    assert crossing.growing
    assert crossing.speed == pytest.approx(V, rel=1e-10)
    omega = np.sqrt((50.0 + 0.5 * 1.2 * V**2 * 0.4) / 2.0)
    assert crossing.k == pytest.approx(0.5 * omega / V, rel=1e-10)
    model = ModalModel(
        modes=modes,
        rows=[[1.0]],
        stiffness=[30.0],
        approximation=FitOptions(lags=0),
        speed_range=(1.0, 20.0),
    )
    assert root_locus(model).flutter.speed == pytest.approx(V, rel=1e-8)
    np.testing.assert_allclose(model.free_stiffness, [[20.0]])


def test_divergence():
    k = np.array([0.0, 0.5, 1.0])
    forces = TabulatedForces(k, (0.8 - 0.2j * k)[:, None, None])
    modes = Modes(mass=[1.0], stiffness=[10.0], forces=forces, semichord=1.0, density=1.0)
    result = pk_method(modes, PKOptions(low=1.0, high=9.0))
    assert result.divergence == pytest.approx(5.0)
    assert result.flutter is None
    model = ModalModel(
        modes=modes, rows=[[1.0]], stiffness=[4.0], approximation=FitOptions(lags=0),
        speed_range=(1.0, 9.0),
    )  # fmt: skip
    assert root_locus(model).divergence == pytest.approx(5.0)


def test_springs_are_taken_out_or_are_beside():
    modes = bah.modes()
    row = np.zeros(10)
    row[3] = 2.0
    half = modes.K[3, 3] / 8.0
    taken = ModalModel(
        modes=modes, rows=[row], stiffness=[half], speed_range=(60.0, 700.0),
        approximation=FitOptions(lags=1),
    )  # fmt: skip
    assert taken.free_stiffness[3, 3] == pytest.approx(modes.K[3, 3] / 2)
    np.testing.assert_allclose(taken.whole().K, modes.K)
    beside = ModalModel(
        modes=modes, rows=[row], stiffness=[half], in_stiffness=[False],
        speed_range=(60.0, 700.0), approximation=FitOptions(lags=1),
    )  # fmt: skip
    assert beside.whole().K[3, 3] == pytest.approx(1.5 * modes.K[3, 3])
    closed = taken.at(300.0)
    np.testing.assert_allclose(
        closed.closed([1.0]), springs_in_a_mode(modes, approximation=FitOptions(lags=1)).at(300.0)
        .closed([1.0]), rtol=1e-9, atol=1e-9,
    )  # fmt: skip
    with pytest.raises(InputError, match="K has less than is taken out of it"):
        ModalModel(modes=modes, rows=[row], stiffness=[5 * half * 1.01])


def test_a_mass_that_the_air_makes_negative_is_refused():
    k = np.array([0.0, 0.5, 1.0])
    forces = TabulatedForces(k, (1 - 0.2j * k + 4.0 * k**2)[:, None, None])
    modes = Modes(mass=[1.0], stiffness=[10.0], forces=forces, semichord=1.0, density=1.0)
    ModalModel(modes=modes, rows=[[1.0]], stiffness=[4.0], approximation=FitOptions(lags=0))
    light = Modes(
        mass=[1.0],
        stiffness=[10.0],
        forces=TabulatedForces(k, (1 - 0.2j * k - 4.0 * k**2)[:, None, None]),
        semichord=1.0,
        density=1.0,
    )
    with pytest.raises(InputError, match="must be positive definite"):
        ModalModel(modes=light, rows=[[1.0]], stiffness=[4.0], approximation=FitOptions(lags=0))


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"mass": [0.0] * 10}, "mass must be positive definite"),
        ({"mass": np.triu(np.ones((10, 10)))}, "mass: must be symmetric"),
        ({"stiffness": np.ones(9)}, "stiffness: must be 10 by 10"),
        ({"density": -1.0}, "density: must be a positive finite number"),
    ],
)
def test_modes_that_cannot_be(change, words):
    modes = bah.modes()
    given = {
        "mass": modes.M, "stiffness": modes.K, "forces": modes.forces, "semichord": 2.0,
        "density": 1.2,
    }  # fmt: skip
    with pytest.raises(InputError, match=words):
        Modes(**(given | change))


def test_what_nothing_touches_is_no_state():
    """Its undamped oscillation would make every stability undecided and a resonance singular."""
    modes = bah.modes()
    model = springs_in_a_mode(modes, approximation=FitOptions(lags=1))
    assert np.flatnonzero(~model.moving).tolist() == [4, 9]
    assert [name for name in model.state_names if name in ("q4", "q5", "q6", "q10")] == ["q4", "q6"]
    assert len(model.state_names) == 2 * 8 + 8
    row = np.zeros(10)
    row[4] = 1.0
    held = ModalModel(
        modes=modes, rows=[row], stiffness=[1.0], speed_range=(60.0, 700.0),
        approximation=FitOptions(lags=1),
    )  # fmt: skip
    assert held.moving.tolist() == [True] * 9 + [False]
    closed = springs_in_a_mode(modes, approximation=FitOptions(lags=1)).at(300.0).closed([1.0])
    whole = held.at(300.0).closed([1.0])
    ours, theirs = np.linalg.eigvals(closed), np.linalg.eigvals(whole)
    assert all(np.abs(theirs - root).min() < 1e-9 * max(1.0, abs(root)) for root in ours)
