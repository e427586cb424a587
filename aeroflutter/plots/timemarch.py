"""Time marches drawn: traces, spring path, phase plane, spectrum, Poincaré section, sweeps."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from aeroflutter.motion.spectra import LEAST_SAMPLES, poincare_section, power_spectrum
from aeroflutter.plots import layout, meaning
from aeroflutter.plots import style as look
from aeroflutter.results.unit import told

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from aeroflutter.model.lure import Real
    from aeroflutter.motion.response import Response
    from aeroflutter.motion.sweeps import Sweep

__all__ = ["FIGURES", "plot_overview", "plot_response", "plot_sweeps"]

PITCH_RATE = r"pitch rate $\alpha'$ (deg per {})"
TAU = look.Clock()
MOST_POINTS = 20_000  # a line of more is drawn by its envelope
UNSETTLED = ("divergent", "undecided", "neutral")


def plot_response(
    response: Response, kind: str = "overview", title: str = "", clock: look.Clock = TAU
) -> Figure:
    """One figure of a response.

    Parameters
    ----------
    response
        A response with its trace recorded.
    kind
        One of `FIGURES`.
    title
        Written above.
    clock
        In what units times and frequencies are.
    """
    if kind == "overview":
        return plot_overview(response, title, clock)
    paint, width, height, rows = FIGURES[kind]
    if kind == "traces" and not _heaves(response):
        rows = 1
    with look.style():
        figure, axes = layout.figure(rows, 1, width=width, height=height, sharex=rows > 1)
        panels = np.atleast_1d(axes)
        paint(panels, response, clock)
        if title:
            panels[0].set_title("")  # the headline says what it is
        layout.finish(figure, title)
    return figure


def plot_overview(response: Response, title: str = "", clock: look.Clock = TAU) -> Figure:
    """Traces above, then spring path, phase plane, spectrum and Poincaré section."""
    from matplotlib.figure import Figure

    with look.style():
        last = _poincare if _heaves(response) else _next_maximum
        small = (_spring_path, _phase_plane, _spectrum, last)
        asked = look.WIDTH.get()
        across = next(n for n in (4, 2, 1) if layout.panels_across(n) == n)
        width = 10.0 if asked is None else asked / layout.INCH
        below = len(small) // across
        height = 7.4 if asked is None else min(2.4 + below * 0.85 * width / across, 9.5)
        figure = Figure(figsize=(width, height), layout="constrained")
        grid = figure.add_gridspec(2 + below, across, height_ratios=(1.0, 1.0, *([1.6] * below)))
        top = figure.add_subplot(grid[0, :] if _heaves(response) else grid[:2, :])
        under = [figure.add_subplot(grid[1, :], sharex=top)] if _heaves(response) else []
        _traces(np.array([top, *under]), response, clock)
        for place, paint in enumerate(small):
            axes = figure.add_subplot(grid[2 + place // across, place % across])
            paint(np.array([axes]), response, clock)
        layout.finish(figure, title)
    return figure


def plot_sweeps(
    sweeps: Sequence[Sweep], reference: float, title: str = "", *, label: str = look.SPEED_RATIO
) -> Figure:
    """Amplitude against speed, up and down, the jumps as arrows.

    Parameters
    ----------
    sweeps
        Passes over the same speeds.
    reference
        Speeds are divided by it: the linear flutter speed, or 1.
    title
        Written above.
    label
        Of the speed axis.
    """
    with look.style():
        figure, axes = layout.figure(width=6.4, height=4.4)
        draw_sweeps(axes, sweeps, reference, label)
        layout.finish(figure, title)
    return figure


def draw_sweeps(axes: Axes, sweeps: Sequence[Sweep], reference: float, label: str) -> None:
    """The same into axes."""
    for one in sweeps:
        _sweep(axes, one, reference)
    axes.set_xlabel(label)
    axes.set_ylabel(look.AMPLITUDE)
    axes.set_ylim(bottom=0)


def draw(axes: Axes, response: Response, clock: look.Clock = TAU) -> None:
    """Pitch against time into axes."""
    time, pitch = _thinned(response.time, told(response.pitch))
    axes.plot(time / clock.second, pitch, color=meaning.EXACT, linewidth=0.9)
    axes.set_xlabel(clock.time)
    axes.set_ylabel(look.PITCH)


def _late(response: Response) -> slice:
    """The steady part: a few periods of a limit cycle, else the last third of the trace."""
    count = response.time.size
    keep = max(2, count // 3)
    if response.state == "lco" and np.isfinite(response.period):
        spacing = response.time[1] - response.time[0]
        keep = min(count, int(np.ceil(2.0 * response.period / spacing)) + 1)
    return slice(count - keep, count)


def _traces(axes: Any, response: Response, clock: look.Clock) -> None:
    """Pitch above heave, where there is one, against time (thesis figures 4.1-4.7)."""
    if axes.size == 1:
        draw(axes[0], response, clock)
        return
    time, pitch, heave = _thinned(response.time, told(response.pitch), response.heave)
    time = time / clock.second
    axes[0].plot(time, pitch, color=meaning.EXACT, linewidth=0.9)
    axes[0].set_ylabel(look.PITCH)
    axes[0].tick_params(labelbottom=False)
    axes[1].plot(time, heave, color=meaning.EXACT, linewidth=0.9)
    axes[1].set_ylabel(look.HEAVE)
    axes[1].set_xlabel(clock.time)
    axes[1].set_xlim(time[0], time[-1])


def _spring_path(axes: Any, response: Response, _: look.Clock) -> None:
    """Moment against pitch: the whole run faint, its end drawn over it (figures 5.5b-5.31b)."""
    _path(axes[0], told(response.pitch), told(response.moment), response)
    axes[0].set_xlabel(look.PITCH)
    axes[0].set_ylabel(look.MOMENT)
    axes[0].set_title("spring path")


def _phase_plane(axes: Any, response: Response, clock: look.Clock) -> None:
    """Pitch rate against pitch."""
    spacing = (response.time[1] - response.time[0]) / clock.second
    rate = np.gradient(response.pitch, spacing)
    _path(axes[0], told(response.pitch), told(rate), response)
    axes[0].set_xlabel(look.PITCH)
    axes[0].set_ylabel(PITCH_RATE.format(clock.per))
    axes[0].set_title("phase plane")


def _path(axes: Axes, x: Real, y: Real, response: Response) -> None:
    """The transient faint, the steady part over it and filling half of the frame."""
    late = _late(response)
    axes.plot(
        x[: late.start + 1], y[: late.start + 1], color=meaning.FAINT, linewidth=0.5, alpha=0.6,
        label="from the start",
    )  # fmt: skip
    axes.plot(x[late], y[late], color=meaning.EXACT, linewidth=1.3, label="the end of the motion")
    if response.state not in ("lco", "aperiodic"):
        return
    for values, limit in ((x, axes.set_xlim), (y, axes.set_ylim)):
        low, high = float(values[late].min()), float(values[late].max())
        limit(1.5 * low - 0.5 * high, 1.5 * high - 0.5 * low)


def _spectrum(axes: Any, response: Response, clock: look.Clock) -> None:
    """Power spectral density of pitch by Welch's method (figures 5.1-5.4)."""
    axes[0].set_title("spectrum")
    if _too_short(axes[0], response):
        return
    spectrum = power_spectrum(response)
    k = clock.hertz(spectrum.k)
    density = spectrum.density * told(1.0) ** 2 / clock.hertz(1.0)
    top = float(density.max())
    axes[0].plot(k[1:], density[1:], color=meaning.EXACT, linewidth=1.0)
    axes[0].set_yscale("log")
    axes[0].set_xlabel(clock.frequency)
    unit = "Hz" if clock.frequency == look.HERTZ else "unit $k$"
    axes[0].set_ylabel(rf"PSD of pitch (deg$^2$ per {unit})")
    if top > 0.0:
        axes[0].set_ylim(1e-9 * top, 4.0 * top)
        main = k[int(np.argmax(density))]
        axes[0].set_xlim(0.0, 12.0 * max(main, k[1]))


def _poincare(axes: Any, response: Response, _: look.Clock) -> None:
    """Heave and pitch at pitch maxima of the second half of the run."""
    axes[0].set_title("Poincaré section")
    if _too_short(axes[0], response):
        return
    section = poincare_section(response)
    pitch = told(section.pitch)
    names = section.state_names
    heave = section.states[:, names.index("xi")] if "xi" in names else np.zeros(pitch.size)
    axes[0].plot(pitch, heave, ".", color=meaning.EXACT, markersize=3.5)
    _open_up(axes[0], pitch, heave)
    axes[0].set_xlabel(r"pitch $\alpha$ at its maxima (deg)")
    axes[0].set_ylabel(look.HEAVE)
    axes[0].locator_params(axis="x", nbins=3)


def _heaves(response: Response) -> bool:
    """Whether there is a heave, which a model from elsewhere has not, beside what is told of."""
    known = np.any(np.isfinite(response.heave))
    return bool(known) and not np.array_equal(response.heave, response.pitch)


def _next_maximum(axes: Any, response: Response, _: look.Clock) -> None:
    """Each maximum of pitch against the one before."""
    axes[0].set_title("next maximum")
    if _too_short(axes[0], response):
        return
    pitch = told(poincare_section(response).pitch)
    axes[0].plot(pitch[:-1], pitch[1:], ".", color=meaning.EXACT, markersize=3.5)
    _open_up(axes[0], pitch[:-1], pitch[1:])
    axes[0].set_xlabel(r"pitch $\alpha$ at its maxima (deg)")
    axes[0].set_ylabel("the next one (deg)")
    axes[0].locator_params(axis="x", nbins=3)


def _too_short(axes: Axes, response: Response) -> bool:
    """Say so in the axes where a trace is too short to be analysed."""
    short = response.time.size < 2 * LEAST_SAMPLES
    if short:
        axes.text(0.5, 0.5, "trace too short", transform=axes.transAxes, ha="center")
    return short


def _open_up(axes: Axes, x: Real, y: Real) -> None:
    """Limits that show a point as a point, not the round-off around it."""
    for values, limit in ((x, axes.set_xlim), (y, axes.set_ylim)):
        if values.size == 0:
            continue
        low, high = float(values.min()), float(values.max())
        middle, size = 0.5 * (low + high), max(abs(low), abs(high), 1e-12)
        half = max(0.6 * (high - low), 0.05 * size)
        limit(middle - half, middle + half)


def _thinned(time: Real, *signals: Real) -> tuple[Real, ...]:
    """Signals of at most `MOST_POINTS`, keeping the extremes of every stretch."""
    stretch = 2 * time.size // MOST_POINTS
    if stretch < 2:
        return (time, *signals)
    rows = time.size // stretch
    shape = (rows, stretch)
    starts = time[: rows * stretch].reshape(shape)
    thinned = [np.repeat(starts[:, 0], 2)]
    for signal in signals:
        block = signal[: rows * stretch].reshape(shape)
        thinned.append(np.stack((block.min(axis=1), block.max(axis=1)), axis=1).ravel())
    return tuple(thinned)


def _sweep(axes: Axes, one: Sweep, reference: float) -> None:
    speed, amplitude = one.speeds / reference, told(one.amplitude)
    line: dict[str, Any] = {
        "color": meaning.INK,
        "linewidth": 0.8,
        "linestyle": "-" if one.upward else "--",
    }
    kinds = np.array(one.state)
    settled = ~np.isin(kinds, UNSETTLED)
    label = "speed rising" if one.upward else "speed falling"
    axes.plot(speed, np.where(settled, amplitude, np.nan), label=label, **line)
    for state in sorted(set(one.state)):
        mark: dict[str, Any] = {
            "marker": "^" if one.upward else "v",
            "color": meaning.STATES[state],
            "markeredgecolor": meaning.INK,
            "markeredgewidth": 0.5,
            "label": f"{meaning.STATE_NAMES.get(state, state)}, {'up' if one.upward else 'down'}",
        }
        pick = kinds == state
        if state in UNSETTLED:  # of no size of its own: along the top
            top = np.ones(int(pick.sum()))
            across = axes.get_xaxis_transform()
            axes.plot(speed[pick], top, ls="none", transform=across, clip_on=False, **mark)
        else:
            axes.plot(speed[pick], amplitude[pick], ls="none", clip_on=False, **mark)
    for jump in one.jumps:
        axes.annotate(
            "",
            xy=(jump.after / reference, told(jump.amplitude_after)),
            xytext=(jump.before / reference, told(jump.amplitude_before)),
            arrowprops={"arrowstyle": "-|>", "color": meaning.INK, "linewidth": 1.0},
        )


Draw = Callable[[Any, "Response", look.Clock], None]

FIGURES: dict[str, tuple[Draw, float, float, int]] = {
    "traces": (_traces, 8.0, 4.6, 2),
    "spring": (_spring_path, 4.8, 4.4, 1),
    "phase": (_phase_plane, 4.8, 4.4, 1),
    "psd": (_spectrum, 6.0, 4.0, 1),
    "poincare": (_poincare, 4.8, 4.4, 1),
}
"""Kind: what draws it, width and height in inches, rows of axes."""
