"""Absence of oscillation: the checker first, since a mistake in it would be believed.

Every step of the checker has a test that fails without it, most of them on systems so small that
the right answer can be seen. The search is tested by what the checker accepts of it and by exact
limit cycles, which share no code with either.
"""

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from aeroflutter import SectionFamily, TypicalSection, load_case
from aeroflutter.errors import InputError
from aeroflutter.guarantees.absence import (
    Certificate,
    Piece,
    Uncovered,
    absence,
    absence_at,
    concerns,
)
from aeroflutter.guarantees.absence.certificate import Linear, Loop, Static
from aeroflutter.guarantees.absence.friction import Friction
from aeroflutter.guarantees.absence.law import law_of, model_of
from aeroflutter.guarantees.absence.search import summits
from aeroflutter.linear.rootlocus import flutter_speed
from aeroflutter.model.elsewhere.placed import PlacedModel
from aeroflutter.model.elsewhere.polynomial import PolynomialModel
from aeroflutter.model.family import SectionModel
from aeroflutter.model.lure import FixedFamily, LureSystem, SampledFamily, SpringFamily
from aeroflutter.springs import Bilinear, Cubic, Freeplay, Hysteresis, Table
from aeroflutter.springs import Linear as LinearSpring

checker = pytest.importorskip("aeroflutter.guarantees.absence.checker")
arb = pytest.importorskip("flint").arb

RUN14 = Path(__file__).parent / "data" / "absence_run14.json"
FLUTTER = flutter_speed(load_case("run14").family())
# Lowest exact limit cycles, docs/errata.md, U*/U*_L.
LOWEST_CYCLE = {"run6": 0.81506, "run10": 0.84892, "run14": 0.92151, "run100": 0.13099}


def refused(certificate, why):
    with pytest.raises(checker.Refused, match=why):
        checker.check(certificate)


UNIT = Static(low=0.0, high=1.0)


def first_order(a, b, spring=UNIT, **piece):
    """y' = a(v) y - b(v) F(y), so H = b/(s + b - a) for slopes between 0 and 1."""
    model = Linear(A=tuple(((one,),) for one in a), b=tuple((one,) for one in b), c=(1.0,))
    given = {"low": 1.0, "high": 1.0} | piece
    return Certificate(model=model, spring=spring, pieces=(Piece(**given),))


@pytest.fixture(scope="module")
def run14():
    return Certificate.load(RUN14)


# The checker


def test_it_accepts_run_14(run14):
    case = load_case("run14")
    assert concerns(run14, case.family(), case.spring)
    found = checker.check(run14)
    assert (found.low, found.high) == run14.speeds
    assert found.low < 0.05 * FLUTTER
    assert 0.9211 * FLUTTER < found.high < LOWEST_CYCLE["run14"] * FLUTTER


def test_a_certificate_concerns_one_case_only(run14):
    case = load_case("run14")
    other = load_case("run14", {"section.mu": 100.0000001})
    assert not concerns(run14, other.family(), case.spring)
    assert not concerns(run14, case.family(), replace(case.spring, delta_h=0.3))
    assert concerns(run14, case.family(), replace(case.spring, v_off=0.1))  # offsets do not matter


def test_the_polynomials_are_those_of_the_transfer_function(run14):
    family = load_case("run14").family()
    n, d = checker._transfer(run14)
    forms = checker._forms(n, d)
    rng = np.random.default_rng(1)
    for speed, omega in zip(rng.uniform(0.5, 5.0, 20), rng.uniform(0.01, 3.0, 20), strict=True):
        inverse = family.at(speed).inverse_transfer(1j * omega)
        H = 1.0 / (inverse + 1.0)
        P, Q, E = (
            sum(float(arb(one(1 / checker._exact(speed))).mid()) * omega ** (2 * i)
                for i, one in enumerate(checker._by_x(form)))
            for form in forms
        )  # fmt: skip
        assert E > 0.0
        np.testing.assert_allclose([P / E, Q / E], [H.imag / omega, H.real - 1.0], rtol=1e-8)


@pytest.mark.parametrize("loop", [True, False])
def test_the_weights_are_those_of_the_theorem(loop):
    terms = ((0.3, 0.7), (2.0, 0.4), (5.0, 0.1))
    w, lam = (1.0 if loop else -0.3), 0.2
    weights = checker._Weights(Piece(low=1.0, high=1.0, w=w, lam=lam, terms=terms), loop)
    H = 0.4 - 0.9j
    for omega in (0.05, 0.9, 3.0, 11.0):
        multiplier = w / (1j * omega) + lam
        value = (multiplier * (H - 1.0)).real
        for t, c in terms:
            if loop:
                value -= c * np.sin(omega * t) / omega
            else:
                value += (c * (1.0 - np.exp(1j * omega * t)) / omega**2 * (H - 1.0)).real
        here, slopes = weights.at(arb(omega))
        forms = H.imag / omega, H.real - 1.0, 1.0
        mixed = sum(float(one) * form for one, form in zip(here, forms, strict=True))
        assert mixed == pytest.approx(value, rel=1e-12)
        step = 1e-5
        above, below = (weights.at(arb(omega + sign * step))[0] for sign in (1, -1))
        for slope, one, two in zip(slopes, above, below, strict=True):
            assert slope.overlaps(arb(float(one - two) / (2 * step), 1e-7))
            assert float(slope.rad()) < 0.01


def test_boxes_hold_the_function(run14):
    """The mean-value form encloses f on boxes of any size, at random points of them."""
    piece = run14.pieces[-1]
    forms = checker._forms(*checker._transfer(run14))
    low, high = 1 / checker._exact(piece.high), 1 / checker._exact(piece.low)
    x, u = checker._RING.gens()
    local = [checker._by_x(f.compose(x, (low + high) / 2 + u * (high - low) / 2)) for f in forms]
    powers = range(max(one.length() for form in local for one in form))
    from flint import arb_poly

    split = [[arb_poly([arb(one[k]) for one in form]) for k in powers] for form in local]
    by_u = list(zip(*split, strict=True))
    weights = checker._Weights(piece, True)
    rng = np.random.default_rng(3)
    for _ in range(60):
        r, half = 2.0 ** rng.integers(-9, 0), 2.0 ** rng.integers(-6, 0)
        omega, centre = float(rng.uniform(r, 2.0)), float(rng.uniform(-1.0 + half, 1.0 - half))
        f, df_du, df_domega = checker._slab(omega, r, weights, by_u)
        rise = abs(df_du(arb(centre, half))) * half + abs(df_domega(arb(centre, half))) * r
        top = f(arb(centre)) + rise
        for _ in range(5):
            at, u = omega + float(rng.uniform(-r, r)), centre + float(rng.uniform(-half, half))
            value, _, along_omega = checker._slab(at, 0.0, weights, by_u)
            assert not value(arb(u)) > top
            assert along_omega(arb(u)).overlaps(df_domega(arb(centre, half)))


def test_a_coarse_grid_proves_what_the_checker_refuses(run14):
    """Run 14 at 0.9216, above its lowest cycle: 600 frequencies see nothing wrong."""
    from scipy.optimize import linprog

    family, speed = load_case("run14").family(), 0.9216 * FLUTTER
    omega = np.geomspace(1e-3, 10.0, 600)
    H = 1.0 / (family.at(speed).inverse_transfer(1j * omega) + 1.0)
    p, q = H.imag / omega, H.real - 1.0
    times = np.linspace(1.0, 150.0, 400)
    S = np.sin(np.outer(omega, times)) / omega[:, None]
    table = np.column_stack((np.ones(600), q, -S, S))
    budget = np.r_[0.0, 0.0, np.ones(800)]
    answer = linprog(
        np.r_[-1.0, np.zeros(801)],
        np.vstack((table, budget)),
        np.r_[-p, 5.0 * (1.0 - 1e-6)],
        bounds=[(None, None)] + [(0.0, None)] * 801,
    )
    lam, c = float(answer.x[1]), answer.x[2:402] - answer.x[402:]
    assert answer.x[0] > 0.0  # 'proved'
    assert lam > 0.0
    terms = tuple((float(t), float(one)) for t, one in zip(times, c, strict=True) if one)
    piece = Piece(low=speed, high=speed, lam=lam, terms=terms)
    refused(replace(run14, pieces=(piece,)), "not negative")


def test_a_spoiled_number_is_refused(run14):
    """Numbers of the hardest piece in turn, by enough to matter."""
    piece = replace(run14.pieces[-1], low=run14.pieces[-1].high)
    rng = np.random.default_rng(7)
    spoiled = [replace(piece, lam=piece.lam * factor) for factor in (0.5, 1.5, -1.0)]
    spoiled.append(replace(piece, high=1.001 * piece.high, low=1.001 * piece.high))
    largest = sorted(range(len(piece.terms)), key=lambda i: -abs(piece.terms[i][1]))[:5]
    for i in largest:
        t, c = piece.terms[i]
        for other in ((t, -c), (t * (1.0 + 0.3 * rng.uniform(0.5, 1.0)), c), (t, 0.0)):
            terms = (*piece.terms[:i], other, *piece.terms[i + 1 :])
            spoiled.append(replace(piece, terms=terms))
    for one in spoiled:
        with pytest.raises(checker.Refused):
            checker.check(replace(run14, pieces=(one,)), 20_000)
    checker.check(replace(run14, pieces=(piece,)))


def test_more_gap_than_the_terms_allow_is_refused(run14):
    spring = replace(run14.spring, delta_h=1.001 * run14.spring.delta_h)
    refused(replace(run14, spring=spring), "not below")
    refused(replace(run14, spring=replace(run14.spring, delta_v=0.0)), "not below")


@pytest.mark.parametrize(
    ("change", "why"),
    [
        ({"w": 0.5}, "w = 1"),
        ({"terms": ((-1.0, 1e-6),)}, "t > 0"),
        ({"lam": -1.0}, "λ is negative"),
        ({"lam": 0.0}, "λ is negative, or zero"),
        ({"lam": float("nan")}, "λ is negative"),
        ({"low": 2.0, "high": 1.0}, "no interval"),
        ({"low": -1.0, "high": 1.0}, "no interval"),
        ({"terms": ((1.0, float("inf")),)}, "not finite"),
    ],
)
def test_hypotheses_of_a_loop(run14, change, why):
    piece = replace(run14.pieces[-1], **change)
    refused(replace(run14, pieces=(piece,)), why)


def test_hypotheses_of_a_static_law():
    good = first_order([0.0], [1.0], lam=0.5, terms=((1.0, 0.2), (-2.0, 0.1)))
    checker.check(good)
    negative = replace(good.pieces[0], terms=((1.0, -0.2),))
    refused(replace(good, pieces=(negative,)), "c ≥ 0")
    refused(replace(good, spring=Static(low=1.0, high=0.0)), "ordered slopes")


def test_pieces_must_meet(run14):
    first, second = run14.pieces
    gap = replace(second, low=np.nextafter(second.low, 9.0))
    refused(replace(run14, pieces=(first, gap)), "leave out a speed")
    refused(replace(run14, pieces=()), "leave out a speed")


def test_hurwitz_is_not_implied_by_the_inequality():
    """y' = 2 y - F: H = 1/(s - 1) has Im H < 0 everywhere, and y grows without bound."""
    refused(first_order([2.0], [1.0]), "not Hurwitz")


def test_a_root_at_zero_is_not_seen_by_the_inequality():
    """y' = v y - F is stable with slope 1 for v < 1 only, yet Im H(jω)/ω = -1/(ω² + (1-v)²) < 0."""
    crossing = first_order([0.0, 1.0], [1.0], low=0.5, high=2.0)
    refused(crossing, "d\\(0\\) has a zero")
    checker.check(first_order([0.0, 1.0], [1.0], low=1.5, high=2.0))


def test_hurwitz_is_asked_of_every_order():
    for roots in ([-1.0, -2.0, -3.0], [-1.0, -0.1 + 2j, -0.1 - 2j], [-1.0, 0.1 + 2j, 0.1 - 2j],
                  [-5.0, -4.0, 0.01], [-1.0, -1.0, -1.0, -0.01 + 1j, -0.01 - 1j]):  # fmt: skip
        d = [checker._exact(one) for one in np.poly(roots).real[::-1]]
        if max(np.real(roots)) < 0.0:
            checker._hurwitz(d)
        else:
            with pytest.raises(checker.Refused):
                checker._hurwitz(d)


def test_the_last_coefficient_is_followed():
    """b = (v - 2)² - 0.01: H changes sign around v = 2, between two ends where all is well."""
    b = [3.99, -4.0, 1.0]
    refused(first_order([-9.0], b, low=0.25, high=1.0, lam=1e-5), "not shown|not negative")
    checker.check(first_order([-9.0], b, low=0.6, high=1.0, lam=1e-5))


def test_the_first_coefficient_is_followed():
    """P = -1 - (1 - v) x: fine at v = 0.5, where the piece is looked at, and not beyond v = 1."""
    model = Linear(
        A=(((1.0, 1.0), (0.0, -1.0)), ((-1.0, 0.0), (0.0, 0.0))),
        b=((1.0, 1.0), (-1.0, 0.0)),
        c=(1.0, 0.0),
    )
    good = Piece(low=1.25, high=2.0)
    claim = Certificate(model=model, spring=UNIT, pieces=(good,))
    assert checker.check(claim).boxes == 0
    refused(replace(claim, pieces=(replace(good, low=0.5),)), "not shown|not negative")


def test_the_discriminant_is_followed(run14):
    """Double precision spoils run 14's own matrices below U = 2.5e-8, by a double root in x."""
    first = run14.pieces[0]
    checker.check(replace(run14, pieces=(first,)))
    refused(replace(run14, pieces=(replace(first, low=0.0),)), "U = 0 is out of reach")
    refused(replace(run14, pieces=(replace(first, low=1e-9),)), "not shown|not negative")


def test_the_ends_of_an_exact_piece_are_looked_at(run14):
    first = run14.pieces[0]
    alone = replace(first, low=0.9 * FLUTTER, high=0.9 * FLUTTER)
    refused(replace(run14, pieces=(alone,)), "not negative|not shown")


def test_down_to_zero_speed_where_there_is_damping():
    case = load_case("run14", {"section.zeta_alpha": 0.02, "section.zeta_xi": 0.01})
    piece = Piece(low=0.0, high=0.8 * FLUTTER)
    claim = Certificate(model=model_of(case.family()), spring=law_of(case.spring), pieces=(piece,))
    assert checker.check(claim).boxes == 0


def test_the_tail_is_needed():
    """Far beyond Ω = 1 the terms outweigh λ, and all is well below it."""
    model = Certificate.load(RUN14).model
    speed, t = 0.5 * FLUTTER, 1.0
    H = 1.0 / (load_case("run14").family().at(speed).inverse_transfer(1j * np.array([1.0])) + 1.0)
    c = 0.5 * float(H.imag[0])  # negative
    piece = Piece(low=speed, high=speed, lam=1e-9, terms=((t, c),))
    claim = Certificate(model=model, spring=Loop(delta_v=1.0, delta_h=0.2), pieces=(piece,))
    omega = np.linspace(1e-3, 1.0, 2000)
    H = 1.0 / (load_case("run14").family().at(speed).inverse_transfer(1j * omega) + 1.0)
    F = H.imag / omega + 1e-9 * (H.real - 1.0) - c * np.sin(omega * t) / omega
    assert F.max() < 0.0
    refused(claim, "not")


def test_the_interval_of_speeds_is_covered_not_sampled(run14):
    """A multiplier that holds in the middle of a piece and fails at its ends."""
    piece = run14.pieces[-1]
    wide = replace(piece, high=1.002 * piece.high, low=0.998 * piece.high)
    refused(replace(run14, pieces=(wide,)), "not negative")
    low = replace(piece, low=0.7 * piece.low)
    with pytest.raises(checker.Refused):
        checker.check(replace(run14, pieces=(low,)), 50_000)


def test_the_slopes_are_those_of_the_whole_box():
    """b = 1 - 6 (v - 0.55)²: level in the middle of the interval of v, negative at its ends."""
    b = [1.0 - 6.0 * 0.55**2, 6.6, -6.0]
    terms = ((1.0, 1e-9),)
    checker.check(first_order([-9.0], b, low=1.2, high=2.5, lam=1e-3, terms=terms))
    with pytest.raises(checker.Refused):
        checker.check(first_order([-9.0], b, low=1.0, high=10.0, lam=1e-3, terms=terms), 5000)


def test_too_many_boxes_is_a_refusal(run14):
    with pytest.raises(checker.Refused, match="too many boxes"):
        checker.check(run14, 100)


def test_precision_is_given_back(run14):
    from flint import ctx

    before = ctx.prec
    checker.check(first_order([0.0], [1.0]))
    refused(first_order([2.0], [1.0]), "Hurwitz")
    assert ctx.prec == before


# The certificate


def test_round_trip(run14, tmp_path):
    path = tmp_path / "proof.json"
    run14.save(path)
    assert Certificate.load(path) == run14
    static = first_order([0.0], [1.0], lam=0.5, terms=((1.0, 0.2),))
    static.save(path)
    assert Certificate.load(path) == static


def test_a_certificate_of_which_any_number_was_altered_is_not_read(tmp_path):
    """By one bit, and even where what it then says is still true; without a digest it is read."""
    path = tmp_path / "proof.json"
    claim = first_order([0.25, 0.5], [1.0], high=2.0, lam=0.5, terms=((1.5, 0.25), (-2.5, 0.125)))
    claim.save(path)
    content = json.loads(path.read_text(encoding="utf-8"))
    places = [*_numbers(content)]
    assert len(places) == 14
    for holder, key in places:
        was = holder[key]
        holder[key] = float(np.nextafter(was, 9.0))
        path.write_text(json.dumps(content), encoding="utf-8")
        with pytest.raises(InputError, match="has been altered"):
            Certificate.load(path)
        holder[key] = was
    content["pieces"][0]["high"], unsealed = 1.5, content | {"digest": None}
    del unsealed["digest"]
    path.write_text(json.dumps(content), encoding="utf-8")
    with pytest.raises(InputError, match="has been altered"):
        Certificate.load(path)
    path.write_text(json.dumps(unsealed), encoding="utf-8")
    checker.check(Certificate.load(path))


def _numbers(content):
    """Where the numbers of a tree are."""
    for key, one in content.items() if isinstance(content, dict) else enumerate(content):
        if isinstance(one, float):
            yield content, key
        elif isinstance(one, (dict, list)):
            yield from _numbers(one)


def test_a_file_that_is_no_certificate(tmp_path):
    path = tmp_path / "proof.json"
    good = json.loads(RUN14.read_text(encoding="utf-8"))
    for bad in ("", "[]", "{}", json.dumps(good | {"format": "other"}),
                json.dumps(good | {"pieces": [{"low": "x", "high": 1.0}]}),
                json.dumps(good | {"spring": {"delta_v": True, "delta_h": 1.0}})):  # fmt: skip
        path.write_text(bad, encoding="utf-8")
        with pytest.raises(InputError, match="holds no certificate"):
            Certificate.load(path)
    with pytest.raises(InputError):
        Certificate.load(tmp_path / "none.json")


# The search, with the checker


@pytest.mark.parametrize(
    ("run", "at_least"), [("run6", 0.8147), ("run10", 0.8482), ("run100", 0.1303)]
)
def test_bounds_of_the_thesis_runs(run, at_least):
    case = load_case(run)
    unit = flutter_speed(case.family())
    free = absence(case.family(), case.spring)
    assert free.certified
    assert free.low < 1e-3 * unit
    assert at_least < free.high / unit < LOWEST_CYCLE[run]
    assert concerns(free.certificate, case.family(), case.spring)
    checker.check(free.certificate)


@pytest.mark.slow
def test_bound_of_run_14():
    case = load_case("run14")
    free = absence(case.family(), case.spring)
    assert 0.9211 < free.high / FLUTTER < LOWEST_CYCLE["run14"]


def test_the_size_of_a_spring_and_its_offsets_do_not_matter():
    family = load_case("run6").family()
    one = absence_at(family, Hysteresis(1.0, 0.5), 0.6 * FLUTTER)
    two = absence_at(family, Hysteresis(0.01, 0.005, 0.3, -0.2), 0.6 * FLUTTER)
    assert one.certificate.pieces == two.certificate.pieces


def test_one_speed_of_a_model_without_speed():
    system = load_case("run14").family().at(0.85 * FLUTTER)
    free = absence_at(FixedFamily(system), Hysteresis(1.0, 0.2), 1.0)
    assert free.certified
    assert not absence_at(FixedFamily(system), Hysteresis(1.0, 2.0), 1.0).certified


def test_static_terms_reach_further_than_none():
    """A resonance below another: no weight of energy and rates alone will do, terms do."""
    case = load_case("run100")
    unit = flutter_speed(case.family())
    assert absence_at(case.family(), Freeplay(1.0), 0.1300 * unit).certified
    assert not absence_at(case.family(), Freeplay(1.0), 0.1312 * unit).certified


def test_static_laws_are_what_their_slopes_are():
    family = load_case("run100").family()
    speed = 0.12 * flutter_speed(family)
    table = Table((-2.0, -1.0, 0.5, 3.0), (-1.2, -0.2, 0.1, 2.6))
    for spring in (Freeplay(1.0, 0.3), Bilinear(0.5, 0.1, 0.25, 0.5), table):
        free = absence_at(family, spring, speed)
        assert free.certified
        assert not free.notes
    softening = Table((-1.0, -0.5, 0.5, 1.0), (-0.6, -0.5, 0.5, 0.6))
    assert "stay bounded" in absence_at(family, softening, 0.01 * speed).notes[0]


def test_a_linear_spring_is_free_up_to_flutter():
    family = load_case("run14").family()
    free = absence(family, LinearSpring(1.0))
    assert free.certified
    assert 0.999 < free.high / FLUTTER < 1.0


def test_what_is_not_covered_is_refused():
    family = load_case("run14").family()
    with pytest.raises(Uncovered, match="cubic"):
        absence(family, Cubic(1.0, 3.0))
    speeds = np.array([1.0, 2.0])
    sampled = SampledFamily(speeds, [family.at(one) for one in speeds])
    with pytest.raises(Uncovered, match="1/U"):
        absence(sampled, Freeplay(1.0))


def test_nothing_is_proved_of_an_undamped_section():
    from aeroflutter.model.aerodynamics import QuasiSteady

    free = absence(SectionFamily(TypicalSection(omega_bar=0.8), QuasiSteady()), Freeplay(1.0))
    assert free.certificate is None
    assert not free.certified


def test_without_python_flint_the_answer_is_not_certified(monkeypatch):
    from aeroflutter.guarantees.absence import interval

    monkeypatch.setattr(interval, "load_checker", lambda: None)
    case = load_case("run100")
    free = absence(case.family(), case.spring)
    assert free.high > 0.13 * flutter_speed(case.family())
    assert not free.certified
    assert "python-flint" in free.notes[0]


# Against motions


def test_motions_from_everywhere_come_to_rest():
    from aeroflutter.motion.endstates import end_state
    from aeroflutter.motion.flow import Flow

    case = load_case("run14")
    prepared = Flow(case.family().at(0.921 * FLUTTER), [case.spring])
    rng = np.random.default_rng(5)
    for size in 10.0 ** rng.uniform(-1.0, 1.5, 8):
        start = size * case.spring.scale * rng.uniform(-1.0, 1.0, 6)
        memory = case.spring.advance(rng.uniform(-1.0, 1.0) * case.spring.delta_h / 2, start[1])
        assert end_state(prepared, start, float(memory)).state == "damped"


def test_an_unstable_system_of_any_kind_gets_none():
    system = LureSystem(
        np.array([[0.0, 1.0], [-1.0, 0.1]]), np.array([0.0, 1.0]), np.array([1.0, 0])
    )
    assert not absence_at(FixedFamily(system), Hysteresis(1.0, 0.1), 1.0).certified


# Friction over gap


def test_what_is_claimed_of_friction_is_what_was_checked():
    """The certificate is for the very ratio; with less friction it is refused."""
    case = load_case("run14")
    found = Friction(case.family()).at(0.9 * FLUTTER)
    assert found.certified
    assert checker.check(found.certificate).high == found.speed
    loop = found.certificate.spring
    assert loop.delta_v / loop.delta_h == found.ratio
    less = replace(found.certificate, spring=replace(loop, delta_v=0.999 * found.ratio))
    refused(less, "not below")
    assert absence_at(case.family(), Hysteresis(1.01 * found.ratio, 1.0), found.speed).certified
    assert not absence_at(case.family(), Hysteresis(0.97 * found.ratio, 1.0), found.speed).certified


@pytest.mark.slow
def test_looking_further_proves_less_friction_to_be_enough():
    """At 0.95 `tolerance` needs 1.8533 times the friction of run 14: the proof comes near."""
    found = Friction(load_case("run14").family(), reach=60.0).at(0.95 * FLUTTER)
    assert found.certified
    assert 1.8533 < found.ratio / 5.0 < 1.869


def test_any_friction_is_enough_where_no_terms_are_needed():
    family = load_case("run14").family()
    found = Friction(family).at(0.7 * FLUTTER)
    assert (found.ratio, found.certified) == (0.0, True)
    assert not found.certificate.pieces[0].terms
    assert np.isinf(Friction(family).at(1.01 * FLUTTER).ratio)


def test_summits_lie_between_samples():
    omega = np.array([0.0, 1.0, 1.7, 3.0, 4.0])
    F = 5.0 - (omega - 2.0) ** 2
    at, heights = summits(omega, F)
    assert (at[-1], heights[-1]) == pytest.approx((2.0, 5.0))
    assert (at[0], at[1]) == (0.0, 4.0)  # both ends, whatever lies there


# Any model that is a polynomial in 1/U


def test_a_spring_in_heave_and_one_in_a_flap():
    heave = SpringFamily(SectionModel(TypicalSection(omega_bar=0.8), springs=("heave",)))
    assert absence_at(heave, Freeplay(0.01), 0.95 * FLUTTER).certified
    case = load_case("conner")
    unit = flutter_speed(case.family())
    free = absence(case.family(), case.spring)
    assert free.certified
    assert 0.16 < free.high / unit < 0.164296  # its lowest limit cycle, of `lco`


def test_models_from_elsewhere_are_the_polynomials_that_they_are():
    """A section given as polynomials, its heave spring linear, is the section itself."""
    whole = SectionModel(TypicalSection(omega_bar=0.8), springs=("pitch", "heave"))
    A0, A1, A2, B2, C = whole.terms
    names = {"names": whole.names, "search_range": whole.search_range}
    given = PolynomialModel(
        A=np.array([A0, A1, A2]), B=np.array([0 * B2, 0 * B2, B2]), C=C, **names
    )
    placed = PlacedModel(given, ("pitch",))
    one, two = model_of(SpringFamily(placed)), model_of(load_case("run14").family())
    np.testing.assert_allclose(one.A, two.A, atol=1e-12)
    np.testing.assert_allclose((one.b, (one.c,) * 3), (two.b, (two.c,) * 3), atol=1e-15)
    loop, speed = Hysteresis(1.0, 0.2), 0.9 * FLUTTER
    assert absence_at(SpringFamily(placed), loop, speed).certified
    other = PolynomialModel(A=np.array([A0, A1]), B=B2[None], C=C, variable="V", **names)
    with pytest.raises(Uncovered, match="1/U"):
        model_of(SpringFamily(PlacedModel(other, ("pitch",))))
