"""What is known of motions: simulations, sweeps of speed, chaos, and springs by themselves."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from aeroflutter.results.schema import (
    Entry,
    Many,
    One,
    Value,
    View,
    along,
    bulk,
    layout,
    within,
)  # fmt: skip
from aeroflutter.results.swings import SWINGS

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from aeroflutter.motion.response import Initial, Response
    from aeroflutter.motion.sweeps import Sweep
    from aeroflutter.springs import Describing

    Array = NDArray[np.float64]

__all__ = ["LAYOUTS", "Pass", "Run", "SpringLaw"]

RESPONSE = layout(
    "engine",
    Value("state", label="end_state"),
    "reason amplitude bias first_harmonic period",
    Value("k", lambda one: 2.0 * np.pi / one.period),
    "rest duration",
    *SWINGS,
    *bulk("extras"),
    *bulk("time pitch heave moment memory", along=("time",)),
    *bulk("states events state_name=state_names"),
    Value("event_part", lambda one: ["time", "kind"], key=None),
    frame=("time",),
)


@dataclass(frozen=True, kw_only=True)
class Run:
    """A response with what it belongs to.

    Attributes
    ----------
    speed, flutter_speed
        U*, and U*_L or None.
    start
        How it began.
    response
        What it came to.
    """

    speed: float
    flutter_speed: float | None
    start: Initial
    response: Response

    @property
    def speed_ratio(self) -> float | None:
        """U*/U*_L, or None."""
        return None if self.flutter_speed is None else self.speed / self.flutter_speed


RUN = layout(
    "speed",
    Value("speed_ratio", optional=True),
    Value("flutter_speed", optional=True),
    "alpha=start.alpha",
    One("", "response", layout=RESPONSE),
    frame=("time",),
)


@dataclass(frozen=True)
class Pass:
    """A sweep of speed with the flutter speed U*_L, or None, to which its ratios refer."""

    sweep: Sweep
    flutter_speed: float | None = None

    @property
    def speed_ratio(self) -> Array | None:
        """U*/U*_L of its runs."""
        return None if self.flutter_speed is None else self.sweep.speeds / self.flutter_speed

    @property
    def jumps(self) -> list[View]:
        """Its jumps, with their speed ratios."""
        unit = self.flutter_speed or np.nan
        return [
            View(jump, ratios=[jump.before / unit, jump.after / unit]) for jump in self.sweep.jumps
        ]


JUMP = layout(
    Value("speed_ratio", "ratios", dims=("side",)),
    Value("amplitude", lambda one: [one.amplitude_before, one.amplitude_after], dims=("side",)),
    *bulk("before after"),
)
PASS = layout(
    Value("direction", lambda one: "up" if one.sweep.upward else "down"),
    *along("visit", "speed_ratio speed=sweep.speeds"),
    Value("state", "sweep.state", label="end_state", dims=("visit",)),
    *(
        Value(name, f"sweep.{name}", dims=("visit",))
        for name in ("amplitude", "bias", "first_harmonic", "period", "rest")
    ),
    Value("reason", "sweep.reason", key=None, dims=("visit",)),
    Many("jumps", layout=JUMP, dim="jump", prefix="jump_"),
    frame=("visit",),
    coordinates=("speed",),
)

# Chaos

MOST_PEAKS = 100  # of one line of JSON
MOTION = layout(
    "verdict name reason lyapunov=exponents.values lyapunov_error=exponents.error",
    "statistical_error=exponents.statistical",
    *within("exponents", "drift resolution dimension"),
    "loops period multiplier floquet_exponent=floquet amplitude bias cycles=section.pitch.size",
    "transient return_time engine",
    Value("peaks", lambda one: one.peaks(MOST_PEAKS), label=None),
)
CHAOS = layout(
    *MOTION.entries,
    *bulk("running=exponents.running running_time=exponents.time blocks=exponents.blocks"),
    *bulk("peak=section.pitch peak_time=section.time peak_states=section.states"),
    *bulk("peak_memory=memory trough=troughs state_name=section.state_names"),
    Value("exponent", lambda one: np.arange(1, one.exponents.values.size + 1), key=None),
    frame=("maximum",),
)
PEAKS = Value("peak", lambda one: one.peaks(), key=None, dims=("peak",))
SCAN = layout(
    Value("value", "values", key=None, dims=("value",)),
    Many("points", "results", layout=layout(*MOTION.entries, PEAKS), dim="value"),
    Value("exponent", lambda one: np.arange(1, one.exponents.shape[1] + 1), key=None),
    frame=("value",),
)

# Springs by themselves


@dataclass(frozen=True, kw_only=True, eq=False)
class SpringLaw:
    """A spring's moment along a prescribed motion, and its describing function.

    Attributes
    ----------
    pitch, moment, memory
        Samples of the motion, rad, (m,).
    amplitude, bias
        Of the describing function, rad, (n,) and one number.
    gains
        F0, n_p and n_q there.
    """

    pitch: Array
    moment: Array
    memory: Array
    amplitude: Array
    bias: float
    gains: Describing

    def gain(self, name: str) -> Array:
        """One of the gains at every amplitude."""
        return np.broadcast_to(getattr(self.gains, name), self.amplitude.shape)


def _gain(name: str, attribute: str) -> Entry:
    return Value(name, lambda one: one.gain(attribute), label=name, dims=("amplitude_deg",))


PATH = layout(*(Value(n, label=n, dims=("sample",)) for n in ("pitch", "moment", "memory")))
GAINS = layout(
    Value("amplitude", label="amplitude", dims=("amplitude_deg",)),
    Value("bias", label="bias"),
    *(_gain("f0", "F0"), _gain("n_p", "n_p"), _gain("n_q", "n_q")),
)
SPRING_LAW = layout(
    One("path", lambda one: one, layout=PATH),
    One("describing", lambda one: one, layout=GAINS),
    frame=("sample",),
)

LAYOUTS = {
    "Response": RESPONSE,
    "Run": RUN,
    "Pass": PASS,
    "ChaosResult": CHAOS,
    "ChaosScan": SCAN,
    "SpringLaw": SPRING_LAW,
}
