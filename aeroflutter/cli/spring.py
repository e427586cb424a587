"""`aeroflutter spring`."""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated

from cyclopts import Parameter

from aeroflutter.cli.common import CaseName, CaseOptions, Output, numbers, say, show_table
from aeroflutter.errors import InputError
from aeroflutter.results.unit import native, told

if TYPE_CHECKING:
    import numpy as np
    from matplotlib.figure import Figure

    from aeroflutter.case import Case
    from aeroflutter.results.motions import SpringLaw
    from aeroflutter.springs import Describing

SAMPLES = 400  # on every stretch between two turning points


def spring(
    case: CaseName,
    *,
    path_deg: Annotated[
        str | None,
        Parameter(
            help="Turning points of a prescribed pitch motion in degrees, as a,b,c; by default one "
            "and a half large cycles."
        ),
    ] = None,
    amplitudes_deg: Annotated[
        str | None,
        Parameter(help="Amplitudes of the describing function, as A:B:N or a,b,c."),
    ] = None,
    bias_deg: Annotated[float, Parameter(help="Bias of the describing function, degrees.")] = 0.0,
    options: CaseOptions = CaseOptions(),
    output: Output = Output(),
) -> None:
    """The restoring moment along a prescribed pitch motion, and the describing function.

    Between two turning points pitch moves monotonically; a spring with memory starts on the
    branch that the thesis prescribes.
    """
    import numpy as np

    from aeroflutter.results.motions import SpringLaw
    from aeroflutter.springs import respond

    output.check()
    loaded = options.load(case)
    output.begin(loaded, "spring")
    law = loaded.spring
    turns = _turns(path_deg, law.scale)
    pitch = _through(turns)
    moment, memory = respond(law, pitch)
    if amplitudes_deg is None:
        amplitude = law.scale * np.geomspace(0.1, 20.0, 200)
    else:
        amplitude = native(numbers("--amplitudes-deg", amplitudes_deg))
        if (amplitude <= 0).any():
            raise InputError("--amplitudes-deg: every amplitude must be positive")
    bias = native(bias_deg)
    found = SpringLaw(
        pitch=pitch,
        moment=moment,
        memory=memory,
        amplitude=amplitude,
        bias=bias,
        gains=law.describing(amplitude, bias),
    )
    output.result(
        loaded,
        lambda: found,
        text=lambda: _print(loaded, turns, respond(law, turns)[0], amplitude, found.gains),
        figure=lambda: _figure(found, loaded.title),
        command="spring",
    )


def _turns(text: str | None, scale: float) -> np.ndarray:
    import numpy as np

    if text is None:
        return 2.0 * scale * np.array([0.0, 1.0, -1.0, 1.0, -1.0])
    turns = native(numbers("--path-deg", text))
    if turns.size < 2:
        raise InputError("--path-deg: needs at least two turning points")
    return np.asarray(turns)


def _through(turns: np.ndarray) -> np.ndarray:
    """Samples of a motion through the turning points, each of which is a sample."""
    import numpy as np

    at = np.linspace(0, turns.size - 1, (turns.size - 1) * SAMPLES + 1)
    return np.interp(at, np.arange(turns.size), turns)


def _print(
    case: Case,
    turns: np.ndarray,
    moments: np.ndarray,
    amplitude: np.ndarray,
    gains: Describing,
) -> None:
    from aeroflutter.results.words import spring_words

    say(case.title)
    words = spring_words(case.spring)
    if words:
        say(words)
    show_table(
        ("turning point (deg)", "moment (deg)"),
        [(told(a), told(m)) for a, m in zip(turns, moments, strict=True)],
    )
    step = max(1, amplitude.size // 20)
    columns = (told(amplitude), gains.n_p, gains.n_q)
    show_table(
        ("amplitude (deg)", "n_p", "n_q"),
        [tuple(map(float, row)) for row in zip(*(c[::step] for c in columns), strict=True)],
    )


def _figure(law: SpringLaw, title: str) -> Figure:
    from aeroflutter.plots.spring import plot_spring
    from aeroflutter.plots.style import literal

    return plot_spring(law.pitch, law.moment, law.amplitude, law.gains, literal(title))
