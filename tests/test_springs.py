"""Springs: their laws, their memory, and their describing functions against brute force."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st

from aeroflutter.errors import InputError
from aeroflutter.springs import (
    Bilinear,
    Cubic,
    Freeplay,
    Hysteresis,
    Linear,
    PiecewiseLinear,
    Spring,
    Table,
    respond,
    simplify,
)

length = st.floats(0.01, 2.0)
shift = st.floats(-1.0, 1.0)
slope = st.floats(-0.5, 2.0)
amplitude = st.floats(0.02, 5.0)
bias = st.floats(-2.0, 2.0)
paths = st.lists(st.floats(-4, 4), min_size=2, max_size=12)


@st.composite
def tables(draw) -> Table:
    steps = draw(st.lists(length, min_size=1, max_size=6))
    slopes = draw(st.lists(slope, min_size=len(steps), max_size=len(steps)))
    pitch = draw(shift) + np.concatenate(([0.0], np.cumsum(steps)))
    moment = draw(shift) + np.concatenate(([0.0], np.cumsum(np.array(steps) * slopes)))
    return Table(tuple(pitch), tuple(moment))


static = st.one_of(
    st.builds(Linear, slope, shift),
    st.builds(Cubic, slope, st.floats(-3.0, 3.0)),
    st.builds(Bilinear, shift, slope, shift, length),
    st.builds(Freeplay, length, shift),
    tables(),
)
loops = st.builds(Hysteresis, length, length, shift, shift)
springs = st.one_of(static, loops)


# --- brute force ---------------------------------------------------------------------------------


def angles_of(pitches, size, mean):
    """Angles at which mean + size·sin θ passes the given pitches, within (-π/2, 3π/2)."""
    ratio = (np.asarray(pitches) - mean) / size
    rising = np.arcsin(ratio[np.abs(ratio) < 1])
    return np.concatenate((rising, np.pi - rising))


NODES, WEIGHTS = np.polynomial.legendre.leggauss(40)


def fourier(moment, points, size):
    """F0, n_p and n_q by quadrature between the corners of a steady answer F(θ).

    Between corners F is entire in θ: forty Gauss points integrate it over half a turn to round-off.
    """
    ends = np.unique(np.concatenate(([-np.pi / 2, np.pi / 2, 3 * np.pi / 2], points)))
    half, middle = np.diff(ends)[:, None] / 2, (ends[:-1] + ends[1:])[:, None] / 2
    theta = middle + half * NODES
    value = moment(theta) * WEIGHTS * half
    shares = [value.sum() / 2, (value * np.sin(theta)).sum(), (value * np.cos(theta)).sum()]
    return np.array(shares) / np.pi / [1.0, size, size]


def brute_force(spring, size, mean):
    """Fourier coefficients of the law itself, its memory taken from a motion already steady."""
    if not isinstance(spring, Hysteresis):
        breaks = spring.pieces().breaks if isinstance(spring, PiecewiseLinear) else np.empty(0)
        points = angles_of(breaks, size, mean)
        return fourier(lambda t: spring.moment(mean + size * np.sin(t)), points, size)
    low, high = mean - size, mean + size
    _, memory = respond(spring, [low, high, low, high, low])
    top, bottom = memory[3:]

    def moment(t):
        pitch = mean + size * np.sin(t)
        return spring.moment(pitch, spring.advance(np.where(t < np.pi / 2, bottom, top), pitch))

    turns = [v + h for v in (spring.v1, spring.v2) for h in (bottom, top)]
    return fourier(moment, angles_of(turns, size, mean), size)


@given(spring=springs, size=amplitude, mean=bias)
@settings(max_examples=300, deadline=None)
def test_closed_forms_against_quadrature_of_the_law(spring, size, mean):
    """Both are good to round-off, so 1e-10 leaves room for amplitudes far below the pitches."""
    if isinstance(spring, Hysteresis) and size <= spring.delta_v / 2:
        return  # without slip the mean is that of whatever memory there was
    found = spring.describing(size, mean)
    error = np.array([found.F0, found.n_p, found.n_q]) - brute_force(spring, size, mean)
    assert np.max(np.abs(error)) < 1e-10


def kinks(spring: Spring, mean: float):
    """Amplitudes at which a motion begins to reach another piece of the law."""
    if isinstance(spring, PiecewiseLinear):
        return np.abs(spring.pieces().breaks - mean)
    return np.abs(spring.corners(mean))


@given(spring=loops, mean=bias)
@settings(max_examples=150, deadline=None)
def test_a_loop_opens_at_its_first_corner(spring, mean):
    """Just beyond it the memory differs between the ends of the motion; just below, it is one."""
    size = float(spring.corners(mean)[0])
    for factor, opens in ((1.0 + 1e-6, True), (1.0 - 1e-6, False)):
        low, high = mean - factor * size, mean + factor * size
        _, memory = respond(spring, [low, high, low, high])
        assert (abs(memory[-1] - memory[-2]) > 1e-10) == opens


@given(spring=springs, size=amplitude, mean=bias)
@example(spring=Hysteresis(1.0, 1.0), size=1.0, mean=1.0)  # at a stop until the lower end slips
@settings(max_examples=150, deadline=None)
def test_partial_derivatives_of_the_closed_forms(spring, size, mean):
    """Central differences are wrong by O(h²), but by O(h^½) at a kink: kinks are left out."""
    if np.any(np.abs(size - kinks(spring, mean)) < 0.02 * (1 + size)):
        return
    h = 1e-5 * max(size, 0.1)
    A, B = size + h * np.array([-1, 1, 0, 0]), mean + h * np.array([0, 0, -1, 1])
    around, centre = spring.describing(A, B), spring.describing(size, mean)
    for value, by_A, by_B in (
        (around.F0, centre.dF0_dA, centre.dF0_dB),
        (around.n_p, centre.dn_p_dA, centre.dn_p_dB),
        (around.n_q, centre.dn_q_dA, centre.dn_q_dB),
    ):
        room = 1e-6 * (1 + 1 / size**2) * (1 + np.max(np.abs(value)))
        assert (value[1] - value[0]) / (2 * h) == pytest.approx(float(by_A), abs=room)
        assert (value[3] - value[2]) / (2 * h) == pytest.approx(float(by_B), abs=room)


def test_a_loop_that_does_not_slip_is_linear():
    found = Hysteresis(1.0, 0.6).describing([0.2, 0.5], [0.1, -0.2])
    np.testing.assert_allclose(found.n_p, 1.0, rtol=1e-14)
    assert np.all(found.n_q == 0)


# --- limits and symmetry -------------------------------------------------------------------------


def f(ratio):
    """(2/π)(asin γ + γ√(1-γ²)), equations 3.40-3.41."""
    return 2 / np.pi * (np.arcsin(ratio) + ratio * np.sqrt(1 - ratio**2))


@given(dv=length, dh=length, more=amplitude)
def test_full_loop_is_the_formula_of_the_thesis(dv, dh, more):
    D, delta = dv / 2, dh / 2
    A = D + delta + more
    found = Hysteresis(dv, dh).describing(A)
    assert found.n_p == pytest.approx(0.5 * (2 - f((D + delta) / A) + f((D - delta) / A)))
    assert found.n_q == pytest.approx(4 * D * delta / (np.pi * A**2))


@given(dv=length, dh=length, part=st.floats(0.001, 0.999))
def test_small_loop_is_the_elastic_perfectly_plastic_one(dv, dh, part):
    """Between D and D + δ the loop never reaches the stops (Jenkins element)."""
    D = dv / 2
    A = D + part * dh / 2
    found = Hysteresis(dv, dh).describing(A)
    assert found.n_p == pytest.approx(0.5 * (1 + f((2 * D - A) / A)), abs=1e-12)
    assert found.n_q == pytest.approx(4 * D * (A - D) / (np.pi * A**2), abs=1e-12)


def test_describing_function_is_continuous_with_a_kink_at_its_corners():
    loop = Hysteresis(0.4, 1.0)
    for corner in np.unique(loop.corners()):
        low, high = loop.describing(corner * (1 - 1e-9)), loop.describing(corner * (1 + 1e-9))
        assert abs(low.N - high.N) < 1e-7
        assert abs(low.dn_q_dA - high.dn_q_dA) > 0.1


@given(spring=springs, size=amplitude, mean=bias, factor=st.floats(1e-3, 1e3))
def test_scaling_the_spring_scales_the_answer(spring, size, mean, factor):
    one = spring.describing(size, mean)
    other = spring.scaled(factor).describing(factor * size, factor * mean)
    assert pytest.approx(complex(one.N), rel=1e-9, abs=1e-11) == other.N
    assert pytest.approx(factor * float(one.F0), rel=1e-9, abs=1e-11 * (1 + factor)) == other.F0


@given(spring=springs, factor=st.floats(1e-3, 1e3))
def test_the_scale_scales(spring, factor):
    if spring.scale != 1.0:  # 1 stands for no scale at all
        assert spring.scaled(factor).scale == pytest.approx(factor * spring.scale)


odd_springs = st.one_of(
    st.builds(Linear, slope),
    st.builds(Cubic, slope, st.floats(-3.0, 3.0)),
    st.builds(Freeplay, length),
    st.builds(Hysteresis, length, length),
)


@given(spring=odd_springs, size=amplitude, mean=bias, phase=st.floats(0.1, 3.0))
def test_odd_springs_answer_oddly(spring, size, mean, phase):
    assert spring.odd
    plus, minus = spring.describing(size, mean), spring.describing(size, -mean)
    assert pytest.approx(complex(minus.N), abs=1e-12) == plus.N
    assert pytest.approx(-float(minus.F0), abs=1e-12) == plus.F0
    path = mean + size * np.sin(phase + np.linspace(0.0, 9.0, 40))
    if path[0] != 0:  # α = 0 starts on the descending branch: it has no mirror image
        np.testing.assert_allclose(respond(spring, path)[0], -respond(spring, -path)[0], atol=1e-12)


@pytest.mark.parametrize(
    ("spring", "odd"),
    [
        (Linear(1.0, 0.1), False),
        (Table((-1, 0, 1), (-2, 0, 2)), True),
        (Table((-1, 0, 1), (-2, 0, 1)), False),
        (Bilinear(0.0, 0.0, -0.25, 0.5), True),
        (Bilinear(-0.1, 0.4, -0.25, 0.5), True),
        (Bilinear(0.25, 0.0, 0.25, 0.5), False),
        (Freeplay(1.0, 0.1), False),
        (Hysteresis(1.0, 0.2, 0.1, -0.1), False),
    ],
)
def test_which_springs_are_odd(spring, odd):
    assert spring.odd is odd
    pitch = np.linspace(0.01, 3.0, 50)
    if not isinstance(spring, Hysteresis):
        assert np.allclose(spring.moment(pitch), -spring.moment(-pitch)) is odd


# --- the law -------------------------------------------------------------------------------------


@given(loop=loops, path=paths)
def test_memory_does_not_depend_on_how_a_motion_is_sampled(loop, path):
    """One long monotone step and many small ones lead to the same memory."""
    at = np.linspace(0, len(path) - 1, 50 * (len(path) - 1) + 1)
    moment, memory = respond(loop, np.interp(at, np.arange(len(path)), path))
    coarse_moment, coarse = respond(loop, path)
    np.testing.assert_allclose(memory[::50], coarse, atol=1e-13)
    np.testing.assert_allclose(moment[::50], coarse_moment, atol=1e-13)


@given(loop=loops, path=paths)
def test_memory_keeps_to_its_stops_and_the_law_is_continuous(loop, path):
    fine = np.interp(np.linspace(0, len(path) - 1, 801), np.arange(len(path)), path)
    moment, memory = respond(loop, fine)
    assert np.all((memory >= loop.h_low - 1e-15) & (memory <= loop.h_high + 1e-15))
    assert np.all(np.abs(np.diff(moment)) <= np.abs(np.diff(fine)) + 1e-12)


@given(loop=loops, more=st.floats(0.1, 3.0))
def test_a_full_loop_dissipates_its_area(loop, more):
    """∮ F dα = ΔV·ΔH, by the trapezoidal rule between the corners."""
    half = (loop.delta_v + loop.delta_h) / 2 + more
    low, high = loop.centre - half, loop.centre + half
    rising = [loop.v1 + loop.h_low, loop.v1 + loop.h_high]
    falling = [loop.v2 + loop.h_high, loop.v2 + loop.h_low]
    path = np.array([low, high, low, *rising, high, *falling, low])
    moment, _ = respond(loop, path)
    work = np.trapezoid(moment[2:], path[2:])
    assert work == pytest.approx(loop.delta_v * loop.delta_h, rel=1e-9)


def test_the_loop_of_figure_3_2_by_hand():
    """ΔV = 1, ΔH = 2: up the unit slope, along V₁, up again; down along V₂."""
    pitch = [-3.0, -0.5, 0.0, 1.5, 3.0, 2.5, 0.5, 0.0, -1.5, -3.0]
    expected = [-2.0, 0.5, 0.5, 0.5, 2.0, 1.5, -0.5, -0.5, -0.5, -2.0]
    np.testing.assert_allclose(respond(Hysteresis(1.0, 2.0), pitch)[0], expected, atol=1e-15)


def test_reversals_on_the_flat_and_on_the_slope():
    """From a flat a reversal leaves along the unit slope to the other flat; a slope it retraces."""
    loop = Hysteresis(1.0, 2.0)
    moment, _ = respond(loop, [-3.0, 0.5, 0.0, -0.5, -1.0, -0.6])
    np.testing.assert_allclose(moment, [-2.0, 0.5, 0.0, -0.5, -0.5, -0.1], atol=1e-15)
    moment, _ = respond(loop, [-3.0, -1.0, -2.0, -1.0, -0.5])
    np.testing.assert_allclose(moment, [-2.0, 0.0, -1.0, 0.0, 0.5], atol=1e-15)


def test_the_starting_branch_is_that_of_the_thesis():
    """α₀ ≥ 0 starts descending (on V₂ where the flat is), α₀ < 0 ascending."""
    loop = Hysteresis(1.0, 2.0)
    start = np.array([0.0, 0.4, 1.0, 5.0, -0.4, -5.0])
    moment = loop.moment(start, loop.initial_memory(start))
    np.testing.assert_allclose(moment, [-0.5, -0.5, 0.0, 4.0, 0.5, -4.0], atol=1e-15)


@given(loop=loops, path=paths)
def test_offsets_only_move_the_loop(loop, path):
    """F = V_off + F₀(α - V_off - H_off), F₀ being the loop without offsets."""
    start = float(loop.initial_memory(path[0]))
    bare = Hysteresis(loop.delta_v, loop.delta_h)
    moved, _ = respond(bare, np.array(path) - loop.centre, start - loop.h_off)
    np.testing.assert_allclose(respond(loop, path, start)[0], loop.v_off + moved, atol=1e-12)


@given(spring=static)
def test_pieces_are_continuous_and_are_the_law(spring):
    if not isinstance(spring, PiecewiseLinear):
        return
    pieces = spring.pieces()
    jumps = np.diff(pieces.slopes) * pieces.breaks + np.diff(pieces.offsets)
    assert np.max(np.abs(jumps), initial=0.0) < 1e-12
    if isinstance(spring, Table):
        np.testing.assert_allclose(spring.moment(spring.pitch), spring.moments, atol=1e-12)


def test_bilinear_law_of_price_alighanbari_and_lee():
    spring = Bilinear(0.25, 0.05, 0.25, 0.5)
    expected = [-1.0, 0.25, 0.25 + 0.05 * 0.25, 0.25 + 0.05 * 0.5, 2.0 + 0.5 * (0.05 - 1)]
    np.testing.assert_allclose(spring.moment([-1.0, 0.25, 0.5, 0.75, 2.0]), expected, atol=1e-15)


def test_a_table_goes_on_with_its_end_slopes():
    table = Table((-1.0, 0.0, 2.0), (-3.0, 0.0, 1.0))
    np.testing.assert_allclose(table.moment([-2.0, 4.0]), [-6.0, 2.0])
    assert table.slope_range() == (0.5, 3.0)


# --- degenerate laws -----------------------------------------------------------------------------

nothing = st.just(0.0)


@given(
    loop=st.one_of(
        st.builds(Hysteresis, nothing, length, shift, shift),
        st.builds(Hysteresis, length, nothing, shift, shift),
        st.builds(Hysteresis, nothing, length, nothing, shift),
        st.builds(Hysteresis, nothing, nothing, shift, shift),
    ),
    path=paths,
    size=amplitude,
    mean=bias,
)
def test_degenerate_loops_are_what_simplify_says(loop, path, size, mean):
    simple = simplify(loop)
    assert not isinstance(simple, Hysteresis)
    np.testing.assert_allclose(respond(loop, path)[0], simple.moment(path), atol=1e-12)
    one, other = loop.describing(size, mean), simple.describing(size, mean)
    assert pytest.approx(complex(other.N), abs=1e-12) == one.N
    assert pytest.approx(float(other.F0), abs=1e-12) == one.F0


@pytest.mark.parametrize(
    ("spring", "simple"),
    [
        (Hysteresis(0.0, 1.0, 0.0, 0.2), Freeplay(1.0, 0.2)),
        (Hysteresis(1.0, 0.0, 0.3, 0.2), Linear(1.0, 0.2)),
        (Hysteresis(0.0, 1.0, 0.5, 0.0), Bilinear(0.5, 0.0, 0.0, 1.0)),
        (Hysteresis(0.5, 1.0), Hysteresis(0.5, 1.0)),
        (Freeplay(0.0, 0.2), Linear(1.0, 0.2)),
        (Bilinear(0.1, 1.0, 0.3, 0.5), Linear(1.0, 0.3 - 0.1)),
        (Cubic(0.7, 0.0), Linear(0.7)),
        (Table((0.0, 1.0), (0.0, 2.0)), Linear(2.0)),
        (Table((0.0, 1.0), (3.0, 3.0)), Table((0.0, 1.0), (3.0, 3.0))),
    ],
)
def test_simplify(spring, simple):
    found = simplify(spring)
    assert type(found) is type(simple)
    pitch = np.linspace(-2, 2, 21)
    np.testing.assert_allclose(found.moment(pitch), simple.moment(pitch), atol=1e-14)


# --- refusal -------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("build", "names"),
    [
        (lambda: Hysteresis(-1.0, float("nan"), "x"), ["delta_v", "delta_h", "v_off"]),
        (lambda: Freeplay(-0.1, float("inf")), ["gap", "centre"]),
        (lambda: Bilinear(delta=-1.0), ["delta"]),
        (lambda: Cubic(None, 1.0), ["beta1"]),
        (lambda: Linear(float("nan")), ["stiffness"]),
        (lambda: Table((1.0, 1.0), (0.0, 1.0)), ["pitch"]),
        (lambda: Table((1.0,), (0.0,)), ["pitch"]),
        (lambda: Table((0.0, 1.0), (0.0, 1.0, 2.0)), ["moments"]),
        (lambda: Table("ab", (0.0, float("nan"))), ["pitch", "moments"]),
        (lambda: Freeplay(1.0).scaled(0.0), ["factor"]),
        (lambda: respond(Freeplay(1.0), [0.0, float("nan")]), ["alpha"]),
    ],
)
def test_bad_springs_are_refused_with_every_problem_named(build, names):
    with pytest.raises(InputError) as error:
        build()
    assert [problem.split(":")[0] for problem in error.value.problems] == names


def test_springs_are_values():
    assert Hysteresis(1, 0.2) == Hysteresis(1.0, 0.2)
    assert len({Freeplay(1.0), Freeplay(1.0), Freeplay(2.0)}) == 2
    with pytest.raises(AttributeError):
        Freeplay(1.0).gap = 2.0


@pytest.mark.parametrize(
    "spring",
    [
        Table((-2, -1, 0, 1.001, 2), (-3, -1, 0, 1.001, 2.999)),
        Table((-2, -1, 1, 2), (-3, -1, 1, 3.001)),
        Table((-1, 0, 1), (-1, 0, 1.003)),
        Bilinear(1e-3, 0.0, -0.25, 0.5),
        Freeplay(1.0, 1e-3),
        Hysteresis(1.0, 0.2, 1e-3),
        Hysteresis(1.0, 0.2, 0.0, 1e-3),
    ],
)
def test_a_spring_that_is_all_but_odd_is_not_odd(spring):
    path = 3.0 * np.sin(np.linspace(0.01, 9.0, 400))
    up, down = respond(spring, path)[0], respond(spring, -path)[0]
    assert 1e-5 < np.max(np.abs(up + down)) < 1e-2
    assert not spring.odd


# --- points on a line are no corners -------------------------------------------------------------


@given(
    corners=tables(),
    cuts=st.lists(st.integers(1, 40), min_size=5, max_size=5),
    unit=st.sampled_from([1.0, np.pi / 180.0]),
)
def test_points_between_the_corners_of_a_table_change_nothing(corners, cuts, unit):
    pitch, moments = np.array(corners.pitch), np.array(corners.moments)
    fine = np.concatenate(
        [
            *(
                np.linspace(a, b, count, endpoint=False)
                for a, b, count in zip(pitch, pitch[1:], np.resize(cuts, pitch.size), strict=False)
            ),
            pitch[-1:],
        ]
    )
    many = Table(tuple(unit * fine), tuple(unit * np.interp(fine, pitch, moments)))
    few = corners.scaled(unit)
    breaks = few.pieces().breaks
    assert many.pieces().breaks.size == breaks.size
    np.testing.assert_allclose(many.pieces().breaks, breaks, rtol=1e-12, atol=1e-14)
    at = unit * np.linspace(pitch[0] - 1.0, pitch[-1] + 1.0, 97)
    np.testing.assert_allclose(many.moment(at), few.moment(at), rtol=1e-9, atol=1e-12)
    assert many.scale == pytest.approx(few.scale, rel=1e-12)


def test_a_fine_table_of_a_gap_has_the_three_pieces_of_a_gap():
    pitch = np.linspace(-6.0, 6.0, 241)
    table = Table(tuple(np.radians(pitch)), tuple(np.radians(Freeplay(2.0).moment(pitch))))
    pieces = table.pieces()
    np.testing.assert_allclose(np.degrees(pieces.breaks), [-1.0, 1.0], rtol=1e-12)
    assert pieces.slopes[0] == pieces.slopes[2] == pytest.approx(1.0, abs=1e-12)
    assert table.piece_table().slopes.size == 2
    assert table.scale == pytest.approx(np.radians(1.0))


def test_bends_that_are_small_one_by_one_are_not_lost():
    pitch = np.linspace(-1.0, 1.0, 2001)
    table = Table(tuple(pitch), tuple(pitch + 1e-9 * pitch**2))
    at = np.linspace(-1.0, 1.0, 333)
    np.testing.assert_allclose(table.moment(at), at + 1e-9 * at**2, rtol=0, atol=1e-14)
