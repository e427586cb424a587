"""Named sets of indicial terms, against Theodorsen's function and the flutter it gives."""

from __future__ import annotations

import tomllib

import numpy as np
import pytest
from oracles import impedance
from scipy.optimize import fsolve
from scipy.special import kve

from aeroflutter.case.case import load_case
from aeroflutter.errors import InputError
from aeroflutter.generated.indicial import SETS
from aeroflutter.linear.rootlocus import flutter_point
from aeroflutter.model.aerodynamics import Wagner
from aeroflutter.model.lure import SectionFamily
from aeroflutter.model.section import TypicalSection

STATED = {"jones": 0.0146, "four-term": 0.00125, "six-term": 0.000206, "ten-term": 1.19e-5}


def theodorsen(k):
    s = 1j * np.asarray(k)
    return kve(1, s) / (kve(0, s) + kve(1, s))


@pytest.mark.parametrize("name", SETS)
def test_set_is_as_near_as_it_says(name: str) -> None:
    """At 20 000 reduced frequencies, SciPy's Bessel functions; 1/2 at infinity, 1 at zero."""
    wagner = Wagner.named(name)
    s = 1j * np.geomspace(1e-7, 1e4, 20_000)
    fitted = 1 - s[:, None] / (s[:, None] + np.array(wagner.b)) @ np.array(wagner.a)
    error = np.abs(fitted - theodorsen(s.imag)).max()
    assert 0.95 * STATED[name] < error <= STATED[name]
    assert sum(wagner.a) == pytest.approx(0.5, abs=1e-15)


def k_method(section: TypicalSection, guess: tuple[float, float]) -> tuple[float, float]:
    """Speed and k at which det B(jk) vanishes with Theodorsen's function itself.

    One term of rate b makes the oracle's Phi = 1 - a p/(p + b); a is chosen so that it is C(k).
    """

    def residual(unknown: np.ndarray) -> list[float]:
        U, k = unknown
        p = 1j * k
        b = 1.0
        a = (1 - complex(theodorsen(k))) * (p + b) / p
        one = impedance(section, [a], [b], U, 1.0, p)
        value = np.linalg.det(one)
        return [value.real, value.imag]

    U, k = fsolve(residual, np.array(guess) * (1.003, 0.997), xtol=1e-10)
    assert np.abs(residual(np.array([U, k]))).max() < 1e-10
    return float(U), float(k)


def test_finest_set_flutters_where_theodorsen_does() -> None:
    """Fifty random sections: speed and k within 1e-4 of the exact k-method."""
    rng = np.random.default_rng(50)
    worst, jones_worst, tried = 0.0, 0.0, 0
    while tried < 50:
        r_alpha = rng.uniform(0.4, 0.8)
        section = TypicalSection(
            mu=np.exp(rng.uniform(np.log(8), np.log(200))),
            a_h=rng.uniform(-0.6, 0.1),
            x_alpha=rng.uniform(0.1, 0.6) * r_alpha,
            r_alpha=r_alpha,
            omega_bar=rng.uniform(0.1, 0.8),
            zeta_alpha=0.005,
            zeta_xi=0.005,
        )
        fine = flutter_point(SectionFamily(section, Wagner.named("ten-term")))
        coarse = flutter_point(SectionFamily(section))
        if fine is None or coarse is None:
            continue
        tried += 1
        U, k = k_method(section, (fine.speed, fine.k))
        worst = max(worst, abs(fine.speed / U - 1), abs(fine.k / k - 1))
        jones_worst = max(jones_worst, abs(coarse.speed / U - 1))
    assert worst < 1e-4
    assert jones_worst > 2e-3  # so that the sets do make a difference


def test_naca_496_with_theodorsen() -> None:
    """Perry, NASA/TP-2015-218765: 173.26 ft/s exact, 172.857 ft/s with Jones's function."""
    found = {}
    for name in ("jones", "ten-term"):
        case = load_case("naca496", {"aerodynamics.indicial": name})
        point = flutter_point(case.family())
        found[name] = case.section.scale.velocity(point.speed) / 0.3048
    assert found["jones"] == pytest.approx(172.857, abs=1e-3)
    assert found["ten-term"] == pytest.approx(173.26, abs=1.1e-2)


def test_aerodynamics_of_a_case() -> None:
    section = "[section]\nomega_bar = 0.8\n[aerodynamics]\n"
    rates = load_case(tomllib.loads(f'{section}model = "quasi-steady-rates"'))
    assert rates.aerodynamics == Wagner(a=(), b=())
    assert load_case(tomllib.loads(rates.text)) == rates
    named = load_case(tomllib.loads(f'{section}indicial = "six-term"'))
    assert named.aerodynamics == Wagner.named("six-term")
    assert named.family().at(3.0).order == 10
    assert load_case(tomllib.loads(named.text)) == named
    with pytest.raises(InputError, match=r"aerodynamics.indicial: names the terms; remove a and b"):
        load_case(tomllib.loads(f'{section}indicial = "jones"\na = [0.1]\nb = [0.2]'))
    with pytest.raises(InputError, match='"jones", "four-term", "six-term" or "ten-term"'):
        load_case(tomllib.loads(f'{section}indicial = "wagner"'))
    with pytest.raises(InputError, match='must be one of "jones", "four-term"'):
        Wagner.named("finest")


def test_quasi_steady_rates_is_theodorsen_with_c_of_one() -> None:
    """Divergence and the roots of the oracle's B with Phi = 1."""
    section = TypicalSection(omega_bar=0.5, a_h=-0.3)
    roots = np.linalg.eigvals(SectionFamily(section, Wagner(a=(), b=())).at(3.0).closed(1.0))
    assert len(roots) == 4
    for root in roots:
        matrix = impedance(section, [], [], 3.0, 1.0, root)
        assert abs(np.linalg.det(matrix)) < 1e-12
