"""The typical section: a rigid airfoil on a heave and a pitch spring, with a flap or without."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, fields
from typing import Any

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

    def reduced(self, k: Any, speed: Any) -> Any:
        """Reduced frequency of ``Im p`` at a speed: itself, tau being the time."""
        return k

    def ratio(self, frequency: Any) -> Any:
        """Frequency over the uncoupled pitch frequency: itself."""
        return frequency

    @property
    def speed_name(self) -> str:
        """What an airspeed is called in tables: it is nondimensional."""
        return "U*"


@dataclass(frozen=True, kw_only=True)
class Flap:
    """Trailing-edge flap on a hinge spring, nondimensional as the section it belongs to.

    Parameters
    ----------
    hinge : float
        Hinge behind mid-chord, in semi-chords; the nose of the flap is there (no overhang).
    x_beta : float
        Static moment of the flap about its hinge, ``S_beta/(m b)``, m being all the mass that
        pitches.
    r_beta : float
        Its radius of gyration about the hinge, ``sqrt(I_beta/m)/b``.
    omega_beta : float
        Uncoupled flap frequency over the uncoupled pitch frequency.
    zeta_beta : float
        Viscous damping ratio.

    Raises
    ------
    InputError
        Every invalid field at once.
    """

    hinge: float
    x_beta: float
    r_beta: float
    omega_beta: float
    zeta_beta: float = 0.0

    def __post_init__(self) -> None:
        problems = _not_finite(self)
        if not problems:
            problems = _positive({name: getattr(self, name) for name in ("r_beta", "omega_beta")})
            if not -1 < self.hinge < 1:
                problems.append(f"hinge: must lie between -1 and 1, got {self.hinge!r}")
            if self.zeta_beta < 0:
                problems.append(f"zeta_beta: must not be negative, got {self.zeta_beta!r}")
        if problems:
            raise InputError(problems)
        _make_floats(self)


@dataclass(frozen=True, kw_only=True)
class FlapSI:
    """A flap given per unit span in SI units; see :meth:`TypicalSection.from_si`.

    Parameters
    ----------
    hinge : float
        Hinge behind mid-chord, in semi-chords.
    S_beta : float
        Static moment about the hinge, kg.
    I_beta : float
        Moment of inertia about the hinge, kg m.
    K_beta, omega_beta : float
        One of: hinge stiffness, N/rad; uncoupled flap frequency, rad/s.
    zeta_beta, c_beta : float
        At most one of: viscous damping ratio; damper, N s/rad.

    Raises
    ------
    InputError
        If a quantity is missing, given twice, not finite or not positive where it must be.
    """

    hinge: float
    S_beta: float
    I_beta: float
    K_beta: float | None = None
    omega_beta: float | None = None
    zeta_beta: float | None = None
    c_beta: float | None = None

    def __post_init__(self) -> None:
        problems = _positive({"I_beta": self.I_beta})
        problems += _exactly_one(vars(self), "K_beta", "omega_beta")
        problems += _damping(vars(self), "zeta_beta", "c_beta")
        problems += [
            f"{name}: must be a finite number, got {getattr(self, name)!r}"
            for name in ("hinge", "S_beta")
            if not _finite(getattr(self, name))
        ]
        if problems:
            raise InputError(problems)

    def nondimensional(self, m: float, b: float, omega_alpha: float) -> Flap:
        """The flap of a section of mass m (kg/m), semi-chord b (m) and omega_alpha (rad/s)."""
        stiffness = self.K_beta
        frequency = self.omega_beta or math.sqrt(_known(stiffness) / self.I_beta)
        return Flap(
            hinge=self.hinge,
            x_beta=self.S_beta / (m * b),
            r_beta=math.sqrt(self.I_beta / m) / b,
            omega_beta=frequency / omega_alpha,
            zeta_beta=_ratio(self.zeta_beta, self.c_beta, self.I_beta, frequency),
        )


@dataclass(frozen=True, kw_only=True)
class TypicalSection:
    """Airfoil section in heave and pitch, with a flap or without, nondimensional.

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
    heave_mass : float
        Mass that moves in heave over m, the mass that pitches: above one where supports heave
        along. The heave frequency is that of all of it.
    flap : Flap, optional
    damping : str
        ``"coordinate"``: each ratio is that of its coordinate alone, all others held.
        ``"modal"``: that of the coupled mode, wind off and with nominal springs, which has the
        largest share of its kinetic energy in that coordinate.
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
    heave_mass: float = 1.0
    flap: Flap | None = None
    damping: str = "coordinate"
    scale: Scale | None = None

    def __post_init__(self) -> None:
        problems = _not_finite(self)
        if not problems:
            problems = self._problems()
        if self.damping not in ("coordinate", "modal"):
            allowed = "'coordinate' or 'modal'"
            problems.append(f"damping: must be {allowed}, got {self.damping!r}")
        if problems:
            raise InputError(problems)
        _make_floats(self)

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
        if self.heave_mass < 1:
            problems.append(
                "heave_mass: must be at least 1, since all that pitches heaves as well, got "
                f"{self.heave_mass!r}"
            )
        return problems or self._flap_problems()

    def _flap_problems(self) -> list[str]:
        """A flap and a wing that are both made of positive masses leave two definite forms."""
        if self.flap is None:
            return []
        flap, arm = self.flap, self.flap.hinge - self.a_h
        # the mass that pitches, its centre and its inertia about the elastic axis: ahead and behind
        product = flap.r_beta**2 + arm * flap.x_beta
        inertia = (
            (1.0, self.x_alpha, flap.x_beta),
            (self.x_alpha, self.r_alpha**2, product),
            (flap.x_beta, product, flap.r_beta**2),
        )
        (m, s, x), (_, i, p), (_, _, r) = inertia
        determinant = m * (i * r - p * p) - s * (s * r - p * x) + x * (s * p - i * x)
        if m * r - x * x > 0 and i * r - p * p > 0 and determinant > 0:
            return []
        return [
            "flap: x_beta and r_beta belong to no flap of this section, or the mass matrix loses "
            f"definiteness; got x_beta = {flap.x_beta!r}, r_beta = {flap.r_beta!r}"
        ]

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
        zeta_alpha: float | None = None,
        zeta_xi: float | None = None,
        m_heave: float | None = None,
        c_h: float | None = None,
        c_alpha: float | None = None,
        flap: FlapSI | None = None,
        damping: str = "coordinate",
    ) -> TypicalSection:
        """Build a section from quantities per unit span in SI units.

        Parameters
        ----------
        m : float
            Mass per unit span that pitches (and heaves), kg/m; all ratios are referred to it.
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
        zeta_alpha, c_alpha : float
            At most one of: viscous damping ratio of pitch; damper, N s/rad.
        zeta_xi, c_h : float
            At most one of: viscous damping ratio of heave; damper, N s/m^2.
        m_heave : float
            Mass per unit span that heaves, supports included, kg/m; m by default.
        flap : FlapSI, optional
        damping : str
            ``"coordinate"`` or ``"modal"``.

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
            "zeta_alpha": zeta_alpha,
            "c_alpha": c_alpha,
            "zeta_xi": zeta_xi,
            "c_h": c_h,
        }
        problems = _positive({"m": m, "b": b, "rho": rho})
        if m_heave is None:
            m_heave = m
        elif not (_finite(m_heave) and m_heave >= m):
            problems.append(f"m_heave: must be a number of at least m = {m!r}, got {m_heave!r}")
        problems += _damping(given, "zeta_alpha", "c_alpha") + _damping(given, "zeta_xi", "c_h")
        dampers = [c_alpha, c_h, flap.c_beta if flap else None]
        if damping == "modal" and any(value is not None for value in dampers):
            problems.append("damping: 'modal' takes ratios zeta of the modes, no dampers c")
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
        heave = omega_h if omega_h is not None else math.sqrt(_known(K_h) / m_heave)
        pitch = (
            omega_alpha if omega_alpha is not None else math.sqrt(_known(K_alpha) / (m * radius**2))
        )
        return cls(
            mu=m / (math.pi * rho * b**2),
            a_h=a_h,
            x_alpha=offset / b,
            r_alpha=radius / b,
            omega_bar=heave / pitch,
            zeta_alpha=_ratio(zeta_alpha, c_alpha, m * radius**2, pitch),
            zeta_xi=_ratio(zeta_xi, c_h, m_heave, heave),
            heave_mass=m_heave / m,
            flap=flap.nondimensional(m, b, pitch) if flap else None,
            damping=damping,
            scale=Scale(b=b, omega_alpha=pitch),
        )


_NO_NUMBERS = ("scale", "flap", "damping")


def _not_finite(item: TypicalSection | Flap) -> list[str]:
    return [
        f"{field.name}: must be a finite number, got {getattr(item, field.name)!r}"
        for field in fields(item)
        if field.name not in _NO_NUMBERS and not _finite(getattr(item, field.name))
    ]


def _make_floats(item: TypicalSection | Flap) -> None:
    """Plain floats, whatever number type came in."""
    for field in fields(item):
        if field.name not in _NO_NUMBERS:
            object.__setattr__(item, field.name, float(getattr(item, field.name)))


def _damping(given: Mapping[str, float | None], ratio: str, damper: str) -> list[str]:
    """Problems of damping that may be stated in either of two ways, or not at all."""
    present = {name: given[name] for name in (ratio, damper) if given[name] is not None}
    if len(present) == 2:
        return [f"{ratio} or {damper}: give one of the two, got both"]
    return [
        f"{name}: must be a finite number that is not negative, got {value!r}"
        for name, value in present.items()
        if not (_finite(value) and _known(value) >= 0)
    ]


def _ratio(ratio: float | None, damper: float | None, inertia: float, frequency: float) -> float:
    """Damping ratio c / (2 I omega), of whichever is given."""
    if damper is not None:
        return damper / (2 * inertia * frequency)
    return 0.0 if ratio is None else ratio


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


def _exactly_one(given: Mapping[str, float | None], first: str, second: str) -> list[str]:
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
