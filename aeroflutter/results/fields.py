"""The one table of what results hold: name, unit, long name, and how a figure or a table heads it.

Results speak radians and nondimensional numbers; files, the command line and figures speak degrees
and, where the section has a scale, m/s, Hz and s. Both translations are the `Kind` of a field, so
they are made here and nowhere else.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING, Any

import numpy as np

from aeroflutter.results.unit import DEGREE, Unit, spoken_unit, start_unit
from aeroflutter.verdicts import STATES, VERDICTS

if TYPE_CHECKING:
    from aeroflutter.model.section import Scale

__all__ = ["FIELDS", "SI", "Field", "Kind"]


@dataclass(frozen=True)
class SI:
    """The companion of a nondimensional field in SI units.

    Attributes
    ----------
    units, long_name
        As in `Field`.
    words, suffix
        How its name follows: `speed` becomes `velocity`, with `_m_s` behind.
    convert
        (scale, value, U*) -> value in SI units.
    at_speed
        Whether U* is needed for it.
    heading
        Of a column of a printed table; `{}` stands for that of the field.
    axis
        Of a figure.
    """

    units: str
    long_name: str
    words: tuple[tuple[str, str], ...]
    suffix: str
    convert: Callable[[Scale, Any, Any], Any]
    at_speed: bool = True
    heading: str = "{}"
    axis: str = ""

    def named(self, name: str) -> str:
        """Its name, from that of the field."""
        for pattern, word in self.words:
            name = re.sub(pattern, word, name)
        return name + self.suffix

    def headed(self, heading: str) -> str:
        """Heading of a column, from that of the field."""
        return self.heading.format(heading)

    def of(self, value: Any, scale: Scale, speed: Any) -> Any:
        """The value in SI units; None where that cannot be said."""
        if value is None or (speed is None and self.at_speed):
            return None
        return self.convert(scale, np.asarray(value, dtype=float), speed)


@dataclass(frozen=True)
class Kind:
    """What sort of quantity a field is.

    Attributes
    ----------
    units
        In files, as the CF conventions write them; "1" is dimensionless.
    suffix
        Of the name in files.
    factor
        From the unit of the API to that of files.
    si
        Its companion in SI units, if it has one.
    missing
        What stands in an array where there is no value.
    dtype
        Of arrays.
    own
        (scale, value, speed) -> value, where a model from elsewhere means something else by it.
    coordinate
        What says in which unit it is told, where that is one of the case: the unit of the
        coordinate of the first spring, or the one in which motions start.
    """

    units: str = "1"
    suffix: str = ""
    factor: float = 1.0
    si: SI | None = None
    missing: Any = np.nan
    dtype: Any = np.float64
    own: Callable[[Scale, Any, Any], Any] | None = None
    coordinate: Callable[[], Unit] | None = None

    @property
    def told(self) -> Kind:
        """The same in the unit in which the coordinate of the first spring is told."""
        unit = DEGREE if self.coordinate is None else self.coordinate()
        if self.coordinate is None or unit.suffix == self.suffix:
            return self
        return replace(self, units=unit.cf, suffix=unit.suffix, factor=unit.factor)

    def of(self, value: Any, scale: Scale | None, speed: Any) -> Any:
        """A value as it is told, given what it is scaled by and the speed that it refers to."""
        if self.own is None or scale is None or value is None or speed is None:
            return value
        return self.own(scale, value, speed)


NUMBER = Kind()
COMPLEX = Kind(dtype=np.complex128)
ANGLE = Kind(DEGREE.cf, DEGREE.suffix, DEGREE.factor, coordinate=spoken_unit)
START = replace(ANGLE, coordinate=start_unit)
SPEED = Kind(
    si=SI(
        *("m s-1", "airspeed V", (("speeds", "velocities"), ("speed", "velocity")), "_m_s"),
        convert=lambda scale, speed, _: scale.velocity(speed),
        at_speed=False,
        heading="V (m/s)",
        axis="airspeed $V$ (m/s)",
    )
)
FREQUENCY = Kind(
    si=SI(
        *("Hz", "frequency", (("(?:^|(?<=_))k$", "frequency"),), "_hz"),
        convert=lambda scale, k, speed: scale.frequency_hz(k, speed),
        heading="f (Hz)",
        axis="frequency (Hz)",
    ),
    own=lambda scale, k, speed: scale.reduced(k, speed),
)
RATIO = Kind(own=lambda scale, value, _: scale.ratio(value))
TIME = Kind(
    si=SI(
        *("s", "time", (), "_s"),
        convert=lambda scale, tau, speed: scale.seconds(tau, speed),
        heading="{} (s)",
        axis="time (s)",
    )
)
FLAG = Kind(missing=-1, dtype=np.int8)
COUNT = Kind(missing=-1, dtype=np.int64)
TEXT = Kind(missing="", dtype=np.str_)


@dataclass(frozen=True)
class Field:
    """One quantity that results hold.

    Attributes
    ----------
    long_name
        What it is.
    kind
        What sort of quantity it is.
    dims
        Dimensions of one value.
    codes
        What whole numbers mean that stand for a text in arrays.
    more
        Further attributes of its variable.
    heading
        Of a column of a printed table.
    axis
        Of a figure.
    pair
        Whether one value is the lowest and the highest of something.
    """

    long_name: str
    kind: Kind = NUMBER
    dims: tuple[str, ...] = ()
    codes: Mapping[int, str] = field(default_factory=dict)
    more: Mapping[str, Any] = field(default_factory=dict)
    heading: str = ""
    axis: str = ""
    pair: bool = False

    @property
    def attributes(self) -> dict[str, Any]:
        """Attributes of its variable, as the CF conventions name them."""
        found: dict[str, Any] = dict(self.more)
        if self.long_name:
            found |= {"units": self.kind.told.units, "long_name": self.long_name}
        if self.codes:
            found["flag_values"] = np.array(list(self.codes), dtype=np.int8)
            found["flag_meanings"] = " ".join(self.codes.values())
        return found


FIELDS: dict[str, Field] = {
    # the flow
    "speed": Field("airspeed U* = V/(b omega_alpha)", SPEED, heading="U*", axis=r"airspeed $U^*$"),
    "speed_ratio": Field(
        "airspeed over the linear flutter speed, U*/U*_L",
        heading="U*/U*_L",
        axis=r"airspeed ratio $U^*/U^*_L$",
    ),
    "velocity": Field("airspeed V", Kind("m s-1")),
    "flutter_speed": Field("linear flutter speed U*_L", SPEED),
    "flutter_k": Field("reduced frequency at the linear flutter speed", FREQUENCY),
    "speed_range": Field("lowest and highest airspeed U* searched", SPEED, pair=True),
    "k": Field("reduced frequency omega b/V", FREQUENCY, heading="k"),
    "omega_ratio": Field(
        "frequency over the uncoupled pitch frequency, omega/omega_alpha",
        RATIO,
        axis=r"frequency $\omega/\omega_\alpha$",
    ),
    "time": Field("nondimensional time tau = V t/b", TIME, axis=r"nondimensional time $\tau$"),
    "duration": Field("time marched, in tau", TIME),
    "period": Field("period in tau", TIME, heading="period"),
    "return_time": Field("mean time from maximum to maximum, in tau", TIME),
    # root locus
    "root": Field("root p of det B(p), per unit of tau = V t/b", COMPLEX, ("speed", "mode")),
    "part": Field("real and imaginary part", TEXT),
    "band": Field("ends of a band", TEXT),
    "side": Field("before and after a jump", TEXT),
    "mode": Field("number of the mode", COUNT, dims=("mode",)),
    "searched": Field("lowest and highest airspeed U* searched", SPEED, pair=True),
    "stiffness": Field("pitch stiffness that stands for the spring"),
    "growing": Field("1 where the oscillation begins to grow", FLAG),
    "coalescence": Field("1 where two frequencies meet", FLAG),
    "unstable_at_low": Field("1 if an oscillation grows at the lowest speed searched", FLAG),
    # cycles, by whatever method
    "amplitude": Field(
        "pitch amplitude, half peak to peak",
        ANGLE,
        heading="amplitude (deg)",
        axis="pitch amplitude (deg)",
    ),
    "bias": Field("midrange of pitch", ANGLE, heading="bias (deg)"),
    "first_harmonic": Field(
        "amplitude of the first harmonic of pitch", ANGLE, heading="first harmonic"
    ),
    "stable": Field("1 where the cycle is stable", FLAG, heading="stable"),
    "family": Field("number of the family of cycles", COUNT, heading="family"),
    "symmetric": Field("1 where the second half of the period mirrors the first", FLAG),
    "multipliers": Field(
        "Floquet multipliers of the period, the trivial one first", COMPLEX, ("multiplier",)
    ),
    "multiplier_error": Field("estimated error of the multipliers"),
    "kind": Field("kind of the event", TEXT),
    "stable_below": Field("1 where the cycles of smaller amplitude are stable", FLAG),
    "stable_above": Field("1 where the cycles of larger amplitude are stable", FLAG),
    "stable_before": Field("1 where the cycles before it are stable", FLAG),
    "stable_after": Field("1 where the cycles after it are stable", FLAG),
    "bifurcation_kind": Field("kind of bifurcation", TEXT),
    "bifurcation_speed": Field("airspeed U* of the bifurcation", SPEED),
    "bifurcation_speed_ratio": Field("the same over the linear flutter speed"),
    "bifurcation_amplitude": Field("pitch amplitude at the bifurcation", ANGLE),
    "bifurcation_period": Field("period in tau at the bifurcation", TIME),
    "bifurcation_family": Field("number of the family of the bifurcation", COUNT),
    "onset_speed": Field("lowest airspeed U* of a limit cycle, by onset_method", SPEED),
    "onset_speed_ratio": Field("the same over the linear flutter speed"),
    "onset_amplitude": Field("pitch amplitude of that limit cycle", ANGLE),
    "closed": Field("1 where the family is a closed loop", FLAG),
    "vary": Field("key of the case that varies", TEXT),
    "value": Field("value of the key that varies"),
    "problems": Field("why values of the key have no result", TEXT),
    "notes": Field("what a reader should know", TEXT),
    # describing functions and their guarantees
    "n_p": Field("describing function, in phase with pitch"),
    "n_q": Field("describing function, in quadrature with pitch"),
    "distortion": Field("predicted harmonics 2-9 of pitch over the first", heading="distortion"),
    "in_thesis_range": Field("1 where the thesis's describing function applies", FLAG),
    "rules_agree": Field("1 where both rules of stability agree", FLAG),
    "biased": Field("1 where the balance of the mean is solved with a free bias", FLAG),
    "mirror_of": Field("number of the family that this one mirrors", COUNT),
    "amplitude_range": Field("lowest and highest amplitude searched", ANGLE, pair=True),
    "guaranteed": Field(
        "1 where a cycle of this first harmonic is proved to lie in the bands", FLAG
    ),
    "guarantee_speed": Field(
        "band of airspeed U* that contains a cycle of this first harmonic", SPEED, ("band",)
    ),
    "guarantee_speed_ratio": Field("the same over the linear flutter speed", dims=("band",)),
    "guarantee_k": Field("band of its reduced frequency", replace(FREQUENCY, si=None), ("band",)),
    "guarantee_amplitude": Field(
        "band of the first harmonic of cycles at this airspeed", ANGLE, ("band",)
    ),
    "guarantee_harmonics": Field("bound on the higher harmonics of the cycle", ANGLE),
    "guarantee_reason": Field("why there is no guarantee", TEXT),
    "guarantee_method": Field("argument that gave the bands", TEXT),
    "exists_at_speed": Field(
        "1 where a cycle is proved to exist at this airspeed in that band", FLAG
    ),
    "contraction_ratio": Field("contraction ratio of the higher harmonics"),
    "expected_error": Field("relative error of U* not exceeded by 95 % of like distortions"),
    "doubtful": Field("1 without guarantee where U* is likely off by more than one per cent", FLAG),
    # the loop at one speed
    "response": Field("G(jk), pitch per moment", COMPLEX, ("k",)),
    "locus": Field("-1/N", COMPLEX, ("locus_amplitude",)),
    "locus_amplitude": Field(
        "amplitude of a point of the locus",
        replace(ANGLE, suffix="", factor=1.0, coordinate=None),
        ("locus_amplitude",),
    ),
    "describing_function": Field("N = n_p + j n_q", COMPLEX),
    "order": Field("number of the harmonic", COUNT, ("order",)),
    "answer": Field("answer of the spring at the harmonic, over the amplitude"),
    "gain": Field("what the loop makes of it"),
    "predicted": Field("predicted harmonic of pitch over the first"),
    "spoils": Field("1 where the harmonic spoils the describing function", FLAG),
    # harmonic balance
    "truncation": Field("estimate of the harmonics left out over the amplitude"),
    "margin": Field("distance from a change of the sequence of switches, over the amplitude"),
    "stability_certain": Field("1 where the multipliers are clear of the unit circle", FLAG),
    "harmonics": Field("highest harmonic", COUNT),
    "harmonic": Field("number of the harmonic", COUNT, ("harmonic",)),
    "converged": Field("1 where every truncation is below the tolerance", FLAG),
    "pitch_harmonic": Field(
        "Y_k of pitch = Re sum of Y_k exp(j k omega tau)",
        replace(ANGLE, dtype=np.complex128),
        ("harmonic",),
    ),
    # exact cycles
    "continuum": Field("1 where the cycle is one of a continuum that differs in bias only", FLAG),
    "closure": Field("what the exact flow misses after one period, over each state's own size"),
    "switches": Field("switches of the spring a period", COUNT),
    "start": Field("a point of the cycle, rad and tau", dims=("state",)),
    "mirrored": Field("1 where the mirror image of every cycle is one, too", FLAG),
    "origin": Field("where the family was found", TEXT),
    "parent": Field("number of the family that it bifurcates from", COUNT),
    "cycles": Field("number of cycles", COUNT),
    "begins": Field("why the family ends at its first cycle", TEXT),
    "ends": Field("why the family ends at its last cycle", TEXT),
    "factor": Field("size of the tolerable spring over that of the case"),
    "unlimited": Field("1 if any size is tolerable", FLAG),
    # proofs
    "any_load": Field("1 where the answer is for every steady load", FLAG),
    "divergence_speed": Field("divergence speed", SPEED),
    "certified": Field("1 where the checker has proved it, 0 where it was only sampled", FLAG),
    "boxes": Field("boxes of frequency and speed that the checker looked at", COUNT),
    "from": Field("lowest airspeed U* of what is proved free of oscillation", SPEED),
    "from_ratio": Field("the same over the linear flutter speed"),
    "piece_low": Field("lowest airspeed U* of a piece of the proof", SPEED),
    "piece_high": Field("highest airspeed U* of a piece of the proof", SPEED),
    "piece_lam": Field("lambda of the multiplier of the piece"),
    "piece_terms": Field("terms of the multiplier of the piece", COUNT),
    "proved": Field("1 where the cycle is proved to exist", FLAG),
    "friction_ratio": Field("friction over gap, delta_v / delta_h, of the case"),
    "proved_ratio": Field("friction over gap from which on nothing oscillates, by proof"),
    "exact_ratio": Field("friction over gap above which no limit cycle was found"),
    "onset_gap": Field("distance from proof to lowest cycle over the speed of that cycle"),
    # motions
    "alpha": Field("initial pitch", START, axis=r"initial pitch $\alpha_0$ (deg)"),
    "pitch": Field("pitch, nose up", ANGLE, axis=r"pitch $\alpha$ (deg)"),
    "heave": Field("heave over the semi-chord, positive down", axis=r"heave $\xi = h/b$"),
    "moment": Field(
        "restoring moment of the spring over its unit stiffness",
        ANGLE,
        axis=r"restoring moment $F(\alpha)$ (deg)",
    ),
    "memory": Field("memory of the spring", ANGLE),
    "f0": Field("mean of the describing function", ANGLE),
    "states": Field("states of the system, rad and tau", dims=("time", "state_name")),
    "state_name": Field("name of the state", TEXT, dims=("state_name",)),
    "events": Field("time and kind of events of the run", dims=("event", "event_part")),
    "event_part": Field("what the columns of events are", TEXT, dims=("event_part",)),
    "state": Field("end state", TEXT, codes=dict(enumerate(STATES)), heading="state"),
    "reason": Field("how the end was decided, or why it could not be", TEXT),
    "engine": Field("engine that ran", TEXT),
    "rest": Field("pitch at which a damped motion comes to rest", ANGLE),
    "direction": Field("whether speeds rise or fall", TEXT),
    "jump_before": Field("airspeed U* before the jump", SPEED),
    "jump_after": Field("airspeed U* after the jump", SPEED),
    # springs, as case files name them
    "delta_v": Field("height of the loop: twice the friction", ANGLE),
    "delta_h": Field("width of the loop: the gap", ANGLE),
    "v_off": Field("offset of the loop in moment", ANGLE),
    "h_off": Field("offset of the loop in pitch", ANGLE),
    "gap": Field("whole width of the gap", ANGLE),
    "friction": Field("friction to either side, half of delta_v", ANGLE),
    "varied": Field("delta_v or delta_h that was tried", ANGLE),
    "centre": Field("middle of the freeplay", ANGLE),
    "m0": Field("preload", ANGLE),
    "alpha_f": Field("pitch at which the inner slope begins", ANGLE),
    "delta": Field("width of the inner slope", ANGLE),
    # chaos
    "lyapunov": Field("Lyapunov exponent per unit of tau", dims=("exponent",)),
    "lyapunov_error": Field("stated error of the Lyapunov exponent", dims=("exponent",)),
    "statistical_error": Field(
        "half-width of the 95 % interval of the mean over blocks", dims=("exponent",)
    ),
    "drift": Field(
        "exponent of the second half of the run minus that of the first", dims=("exponent",)
    ),
    "resolution": Field("ln m / T: growth in proportion to time looks that unstable"),
    "running": Field(
        "finite-time Lyapunov exponent up to running_time", dims=("running_time", "exponent")
    ),
    "running_time": Field("length of the run in tau", TIME, dims=("running_time",)),
    "blocks": Field("Lyapunov exponent of one block of the run", dims=("block", "exponent")),
    "exponent": Field("number of the exponent, from the largest", COUNT, dims=("exponent",)),
    "peak": Field("maximum of pitch", ANGLE, ("maximum",)),
    "peaks": Field("maxima of pitch: of one period, or the last ones", ANGLE, ("peak",)),
    "trough": Field("lowest minimum of pitch since the maximum before", ANGLE, ("maximum",)),
    "peak_time": Field("nondimensional time tau of the maximum", TIME, ("maximum",)),
    "peak_memory": Field("memory of the spring at the maximum", ANGLE, ("maximum",)),
    "peak_states": Field("states at the maximum, rad and tau", dims=("maximum", "state_name")),
    "verdict": Field("kind of motion", TEXT, codes=dict(enumerate(VERDICTS))),
    "name": Field("kind of motion, with n of a periodic one", TEXT),
    "loops": Field("maxima of pitch in one period, 0 if not periodic", COUNT),
    "dimension": Field("Kaplan-Yorke dimension"),
    "multiplier": Field("largest modulus of the Floquet multipliers"),
    "floquet_exponent": Field("exponent of the largest multiplier, per unit of tau"),
    "transient": Field("maxima left out before the measurement", COUNT),
    # maps and sweeps
    "decided_at": Field("nondimensional time tau after which the end state was certain", TIME),
    "attractor": Field("number of the attractor: cells with one number end on the same", COUNT),
    "boundary_x": Field("refined boundary between a cell and the next along the first axis"),
    "boundary_y": Field("refined boundary between a cell and the next along the second axis"),
    "sample": Field("number of the section in the sample", COUNT),
    "valid": Field("whether the values make a section", COUNT),
    "marched_at": Field("airspeed U* at which the end state was sought", SPEED),
    "marched_at_m_s": Field("the same as airspeed V", Kind("m s-1")),
    "flutter_velocity_m_s": Field("linear flutter speed V", Kind("m s-1")),
    "flutter_frequency_hz": Field("frequency at the linear flutter speed", Kind("Hz")),
    "onset_velocity_m_s": Field("lowest airspeed V of a limit cycle", Kind("m s-1")),
}
