"""A section as a modal model: its forces tabulated from Theodorsen's function itself."""

import numpy as np
from scipy.special import kv

from aeroflutter.generated import flap as flap_equations
from aeroflutter.generated import section as section_equations
from aeroflutter.model.equations import _call, _parameters, wind_off
from aeroflutter.model.family import SectionModel


def theodorsen(k):
    """C(k) by modified Bessel functions; 1 at k = 0."""
    with np.errstate(invalid="ignore"):
        value = kv(1, 1j * k) / (kv(0, 1j * k) + kv(1, 1j * k))
    return np.where(k > 0, value, 1.0)


def tables(section, k):
    """Variables of a modal model in SI units, coordinates heave/b, pitch and flap.

    ``m b² E (Ms q'' + ω_α C1 q' + ω_α² K q) = ½ρV² Q q`` with ``E`` the inertias that make rows of
    the section's equations symmetric.
    """
    equations = section_equations if section.flap is None else flap_equations
    values, scale = _parameters(section), section.scale
    inertia = [1.0, section.r_alpha**2] + ([] if section.flap is None else [section.flap.r_beta**2])
    E = np.diag(inertia)
    mass = E @ _call(equations.structural_mass, values)
    springs = E @ _call(equations.spring_terms, values)
    model = SectionModel(section)
    n = len(inertia)
    total = _call(equations.mass_matrix, values)
    damping = -E @ total @ model.terms.A1[n : 2 * n, n : 2 * n]
    C0 = _call(equations.damping_terms, values)[0]
    air_mass = _call(equations.apparent_mass, values)
    K0 = _call(equations.air_stiffness, values) if section.flap is not None else np.zeros((n, n))
    g, w_q, w_v = _call(equations.circulatory, values)
    p = 1j * np.asarray(k)[:, None, None]
    lift = g[:, None] * (w_q + p * w_v)
    C = theodorsen(np.asarray(k))[:, None, None]
    forces = E @ (p**2 * air_mass + p * C0 + K0 + C * lift)
    density = 1.2
    b = scale.b
    m = section.mu * np.pi * density * b**2
    own = m * b**2
    return {
        "M": own * mass,
        "C": own * scale.omega_alpha * damping,
        "K": own * scale.omega_alpha**2 * springs,
        "k": np.asarray(k),
        "Q": -2 * m / density * forces,
        "semichord": b,
        "density": density,
        "stiffness": own * scale.omega_alpha**2 * np.diag(springs),
        "wind_off": wind_off(section).frequencies * scale.omega_alpha,
    }
