"""How large one of several springs may be, its gap or its friction, while the others stay.

With the others fixed nothing is scale-free: every value tried takes the limit cycles of its own.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numpy as np

from aeroflutter.errors import ConvergenceError, InputError
from aeroflutter.springs import Freeplay, Friction, Hysteresis, Spring

if TYPE_CHECKING:
    from aeroflutter.model.lure import AnyFamily
    from aeroflutter.orbits.cycles.options import CycleOptions
    from aeroflutter.studies.tolerance import Tolerance

__all__ = ["tolerance_among"]

_STEP = 10.0**0.5  # between factors that are tried until the answer is enclosed
_REACH = 100.0  # largest factor tried, and its inverse
_RELATIVE = 1e-3  # of the answer
_MOTIONS = 10  # at each speed, of a trial
_FIELDS: dict[str, dict[type, str]] = {
    "gap": {Hysteresis: "delta_h", Freeplay: "gap"},
    "friction": {Hysteresis: "delta_v", Friction: "friction"},
}


def tolerance_among(
    vary: str,
    family: AnyFamily,
    springs: Sequence[Spring],
    which: int,
    speed_ratio: float,
    amplitude: float,
    options: CycleOptions | None = None,
) -> Tolerance:
    """What one of several springs may be; see `tolerance`.

    Parameters
    ----------
    vary
        "size", "gap" or "friction" of the spring.
    which
        Its place.
    amplitude
        Largest amplitude of the first spring's coordinate.

    Raises
    ------
    InputError
        If there is no such spring, or it has no gap or friction.
    ConvergenceError
        If no value from a hundredth to a hundred times the one given is tolerable.
    """
    if not 0 <= which < len(springs):
        raise InputError(f"which: there are springs 0 to {len(springs) - 1}, not {which!r}")
    trials = _Trials(vary, family, springs, which, speed_ratio, amplitude, options)
    good, bad = trials.bracket()
    if good is None:
        raise ConvergenceError(
            f"no {vary} from {1.0 / _REACH:g} to {_REACH:g} times that of the case keeps the "
            "stable limit cycles below the amplitude, the other springs as they are"
        )
    return trials.answer(good if bad is None else trials.bisected(good, bad), bad is None)


class _Trials:
    """One spring of many sizes."""

    def __init__(
        self,
        vary: str,
        family: AnyFamily,
        springs: Sequence[Spring],
        which: int,
        speed_ratio: float,
        amplitude: float,
        options: CycleOptions | None,
    ) -> None:
        self.vary, self.family, self.springs, self.which = vary, family, tuple(springs), which
        self.speed_ratio, self.amplitude, self.options = speed_ratio, amplitude, options
        self.given = springs[which]
        self.field = "" if vary == "size" else _FIELDS[vary].get(type(self.given), "")
        if vary != "size" and not (self.field and getattr(self.given, self.field) > 0.0):
            raise InputError(f'spring.kind: "{self.given.kind}" has no {vary} to vary')
        self.up = vary != "friction"  # towards what is worse
        self.tried: dict[float, float] = {}

    def at(self, factor: float) -> Spring:
        """The spring, so many times as large."""
        if not self.field:
            return self.given.scaled(factor)
        changed: Any = {self.field: factor * getattr(self.given, self.field)}
        return replace(self.given, **changed)  # type: ignore[type-var]

    def varied(self, factor: float) -> float:
        """What varies: the gap, twice the friction, or the factor itself."""
        if not self.field:
            return factor
        twice = 2.0 if self.field == "friction" else 1.0
        return twice * factor * float(getattr(self.given, self.field))

    def all(self, factor: float) -> tuple[Spring, ...]:
        """All springs."""
        changed = list(self.springs)
        changed[self.which] = self.at(factor)
        return tuple(changed)

    def size(self, factor: float) -> float:
        """Largest stable amplitude up to the speed; infinite where it grows without bound."""
        from aeroflutter.studies.tolerance import largest_stable, search_up_to

        if factor not in self.tried:
            coarse = replace(self._settings(), points=2)
            coarse = replace(coarse, simulations=min(coarse.simulations, _MOTIONS))
            search = search_up_to(self.family, self.all(factor), self.speed_ratio, coarse)
            try:
                worst = largest_stable(search, self.speed_ratio * search.frame.reference)
            except ConvergenceError:
                self.tried[factor] = float("inf")
            else:
                self.tried[factor] = 0.0 if worst is None else worst.amplitude
        return self.tried[factor]

    def _settings(self) -> CycleOptions:
        """Where to look: no further than the speed, and at no branches of unstable cycles.

        Stable cycles are found by the motions that end on them.
        """
        from aeroflutter.orbits.cycles.options import CycleOptions

        options = self.options or CycleOptions()
        low = min(options.speed_ratio_range[0], 0.98 * self.speed_ratio)
        return replace(options, depth=0, speed_ratio_range=(low, 1.02 * self.speed_ratio))

    def bracket(self) -> tuple[float | None, float | None]:
        """The last factor that is good on the way to what is worse, and the first that is not."""
        step = _STEP if self.up else 1.0 / _STEP
        factor, good = 1.0, self.size(1.0) <= self.amplitude
        while 1.0 / _REACH < factor * (step if good else 1.0 / step) < _REACH:
            following = factor * step if good else factor / step
            if (self.size(following) <= self.amplitude) is not good:
                return (factor, following) if good else (following, factor)
            factor = following
        return (factor, None) if good else (None, factor)

    def bisected(self, good: float, bad: float) -> float:
        """The last factor that is good between one that is and one that is not."""
        while abs(bad / good - 1.0) > _RELATIVE:
            factor = self._guess(good, bad)
            if self.size(factor) <= self.amplitude:
                good = factor
            else:
                bad = factor
        return good

    def _guess(self, good: float, bad: float) -> float:
        """Where the amplitude is reached if it is a power of the factor, else the middle."""
        small, large = self.tried[good], self.tried[bad]
        middle = float(np.sqrt(good * bad))
        if not (0.0 < small < large < np.inf):
            return middle
        part = np.log(self.amplitude / small) / np.log(large / small)
        nearest = 0.5 * _RELATIVE / abs(np.log(bad / good))
        part = float(np.clip(part, nearest, 1.0 - nearest))
        if len(self.tried) % 3 == 0:  # now and then, so that the enclosure shrinks from both sides
            return middle
        return float(good * (bad / good) ** part)

    def answer(self, factor: float, whole: bool) -> Tolerance:
        """The spring of a factor, the cycles with it, and how it was come to."""
        from aeroflutter.studies.tolerance import (
            Tolerance,
            largest_stable,
            search_up_to,
            uncovered,
        )

        search = search_up_to(self.family, self.all(factor), self.speed_ratio, self._settings())
        speed = self.speed_ratio * search.frame.reference
        branch = search.result()
        notes = [*branch.notes, *uncovered(branch, self.speed_ratio)]
        if whole:
            way = "larger" if self.up else "smaller"
            notes.append(
                f"every {self.vary} that was tried is tolerable; {way} ones were not tried"
            )
        worst = largest_stable(search, speed)
        if worst is not None and worst.amplitude > (1.0 + _RELATIVE) * self.amplitude:
            notes.append("a larger stable cycle was found in the end than when it was tried")
        tried = sorted((self.varied(one), size) for one, size in self.tried.items())
        return Tolerance(
            spring=self.at(factor),
            factor=factor,
            worst=worst,
            amplitude=self.amplitude,
            speed=speed,
            speed_ratio=self.speed_ratio,
            branch=branch,
            notes=tuple(notes),
            vary=self.vary,
            trials=tuple(tried),
            which=self.which,
        )
