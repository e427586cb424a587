"""The typical section: a rigid airfoil on a heave spring and a pitch spring."""

from __future__ import annotations

import math
from dataclasses import dataclass, fields

from aeroflutter.errors import InputError


@dataclass(frozen=True)
class Scale:
    """What turns nondimensional results into SI units.

    Parameters
    ----------
    b : float
        Semi-chord, m.
    omega_alpha : float
        Uncoupled pitch frequency, rad/s.
    """

    b: float
    omega_alpha: float

    def __post_init__(self) -> None:
        problems = [
            f"{name}: must be a positive finite number, got {value!r}"
            for name, value in (("b", self.b), ("omega_alpha", self.omega_alpha))
            if not (math.isfinite(value) and value > 0)
        ]
        if problems:
            raise InputError(problems)

    def velocity(self, speed: float) -> float:
        """Airspeed V in m/s of the nondimensional speed U* = V/(b omega_alpha)."""
        return speed * self.b * self.omega_alpha

    def speed(self, velocity: float) -> float:
        """Nondimensional speed U* of the airspeed V in m/s."""
        return velocity / (self.b * self.omega_alpha)

    def frequency_hz(self, k: float, speed: float) -> float:
        """Frequency in Hz of the reduced frequency k = omega b/V at the speed U*."""
        return k * speed * self.omega_alpha / (2 * math.pi)

    def seconds(self, tau: float, speed: float) -> float:
        """Time in s of the nondimensional time tau = V t/b at the speed U*."""
        return tau / (speed * self.omega_alpha)


@dataclass(frozen=True, kw_only=True)
class TypicalSection:
    """Two-degree-of-freedom airfoil section, nondimensional.

    Parameters
    ----------
    omega_bar : float
        Ratio of the uncoupled heave and pitch frequencies.
    mu : float
        Mass ratio m/(pi rho b^2).
    a_h : float
        Elastic axis behind mid-chord, in semi-chords.
    x_alpha : float
        Centre of mass behind the elastic axis, in semi-chords.
    r_alpha : float
        Radius of gyration about the elastic axis, in semi-chords.
    zeta_alpha, zeta_xi : float
        Viscous damping ratios of pitch and heave.
    scale : Scale, optional
        Lets results carry SI units.

    Raises
    ------
    InputError
        Every invalid field at once.

    Notes
    -----
    Thesis eqs. 3.5-3.8. The defaults are the thesis's values; ``omega_bar`` has none.
    """

    omega_bar: float
    mu: float = 100.0
    a_h: float = -0.5
    x_alpha: float = 0.25
    r_alpha: float = 0.5
    zeta_alpha: float = 0.0
    zeta_xi: float = 0.0
    scale: Scale | None = None

    def __post_init__(self) -> None:
        problems = [
            f"{field.name}: must be a finite number, got {getattr(self, field.name)!r}"
            for field in fields(self)
            if field.name != "scale" and not _finite(getattr(self, field.name))
        ]
        if not problems:
            problems = self._problems()
        if problems:
            raise InputError(problems)
        for field in fields(self):
            if field.name != "scale":  # plain floats, whatever number type came in
                object.__setattr__(self, field.name, float(getattr(self, field.name)))

    def _problems(self) -> list[str]:
        problems = [
            f"{name}: must be positive, got {getattr(self, name)!r}"
            for name in ("mu", "omega_bar", "r_alpha")
            if getattr(self, name) <= 0
        ]
        problems += [
            f"{name}: must not be negative, got {getattr(self, name)!r}"
            for name in ("zeta_alpha", "zeta_xi")
            if getattr(self, name) < 0
        ]
        if 0 < self.r_alpha <= abs(self.x_alpha):
            problems.append(
                f"r_alpha: must exceed |x_alpha| = {abs(self.x_alpha)!r}, or the mass matrix "
                f"loses definiteness, got {self.r_alpha!r}"
            )
        return problems

    @classmethod
    def from_si(
        cls,
        *,
        m: float,
        b: float,
        rho: float,
        a_h: float = -0.5,
        x_cg: float | None = None,
        S: float | None = None,
        I_alpha: float | None = None,
        r: float | None = None,
        K_h: float | None = None,
        omega_h: float | None = None,
        K_alpha: float | None = None,
        omega_alpha: float | None = None,
        zeta_alpha: float = 0.0,
        zeta_xi: float = 0.0,
    ) -> TypicalSection:
        """Build a section from quantities per unit span in SI units.

        Parameters
        ----------
        m : float
            Mass per unit span, kg/m.
        b : float
            Semi-chord, m.
        rho : float
            Air density, kg/m^3.
        a_h : float
            Elastic axis behind mid-chord, in semi-chords.
        x_cg, S : float
            One of: centre of mass behind the elastic axis, m; static moment m*x_cg, kg.
        I_alpha, r : float
            One of: moment of inertia about the elastic axis, kg m; radius of gyration, m.
        K_h, omega_h : float
            One of: heave stiffness, N/m^2; uncoupled heave frequency, rad/s.
        K_alpha, omega_alpha : float
            One of: pitch stiffness, N/rad; uncoupled pitch frequency, rad/s.
        zeta_alpha, zeta_xi : float
            Viscous damping ratios.

        Raises
        ------
        InputError
            If a quantity is missing, given twice, not finite or not positive where it must be.
        """
        given = {
            "x_cg": x_cg,
            "S": S,
            "I_alpha": I_alpha,
            "r": r,
            "K_h": K_h,
            "omega_h": omega_h,
            "K_alpha": K_alpha,
            "omega_alpha": omega_alpha,
        }
        problems = _positive({"m": m, "b": b, "rho": rho})
        for first, second in (
            ("x_cg", "S"),
            ("I_alpha", "r"),
            ("K_h", "omega_h"),
            ("K_alpha", "omega_alpha"),
        ):
            problems += _exactly_one(given, first, second)
        if problems:
            raise InputError(problems)
        offset = x_cg if x_cg is not None else _known(S) / m
        radius = r if r is not None else math.sqrt(_known(I_alpha) / m)
        heave = omega_h if omega_h is not None else math.sqrt(_known(K_h) / m)
        pitch = (
            omega_alpha if omega_alpha is not None else math.sqrt(_known(K_alpha) / (m * radius**2))
        )
        return cls(
            mu=m / (math.pi * rho * b**2),
            a_h=a_h,
            x_alpha=offset / b,
            r_alpha=radius / b,
            omega_bar=heave / pitch,
            zeta_alpha=zeta_alpha,
            zeta_xi=zeta_xi,
            scale=Scale(b=b, omega_alpha=pitch),
        )


def _finite(value: object) -> bool:
    return isinstance(value, int | float) and not isinstance(value, bool) and math.isfinite(value)


def _known(value: float | None) -> float:
    assert value is not None  # guaranteed by _exactly_one
    return value


def _positive(values: dict[str, float]) -> list[str]:
    return [
        f"{name}: must be a positive finite number, got {value!r}"
        for name, value in values.items()
        if not (_finite(value) and value > 0)
    ]


def _exactly_one(given: dict[str, float | None], first: str, second: str) -> list[str]:
    """Problems of a quantity that may be stated in either of two ways."""
    present = {name: given[name] for name in (first, second) if given[name] is not None}
    if len(present) != 1:
        count = "both" if present else "neither"
        return [f"{first} or {second}: give exactly one of the two, got {count}"]
    name, value = next(iter(present.items()))
    if name in ("x_cg", "S"):  # the centre of mass may lie on either side of the axis
        return [] if _finite(value) else [f"{name}: must be a finite number, got {value!r}"]
    assert value is not None
    return _positive({name: value})
