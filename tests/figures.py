"""What of a figure lies over what: texts over one another, or beyond the edge of the paper."""

from itertools import combinations

from matplotlib.axis import Axis
from matplotlib.figure import Figure
from matplotlib.text import Text

SPARE = 1.0  # pixels by which boxes of text may meet: a box is a little larger than its letters


def texts(figure: Figure) -> list[tuple[str, object]]:
    """Every text that is seen, with its box in pixels."""
    figure.draw_without_rendering()
    unseen = set()
    for axes in figure.axes:
        for axis in (axes.xaxis, axes.yaxis):
            unseen |= _beyond(axis)
    return [
        (one.get_text(), Text.get_window_extent(one))
        for one in figure.findobj(Text)
        if one.get_visible() and one.get_text().strip() and one not in unseen and _shown(one)
    ]


def _shown(one: Text) -> bool:
    """Whether the axes that a text belongs to are shown."""
    axes = one.axes
    return axes is None or axes.axison or one in axes.texts or one is axes.title


def _beyond(axis: Axis) -> set[Text]:
    """Labels of ticks that lie outside the view, and are not drawn."""
    place = axis.get_transform().transform
    low, high = sorted(place(axis.get_view_interval()))
    room = 1e-9 * (high - low)
    ticks = [*axis.get_major_ticks(), *axis.get_minor_ticks()]
    return {
        label
        for tick in ticks
        for label in (tick.label1, tick.label2)
        if not (low - room <= place(tick.get_loc()) <= high + room) or not label.get_visible()
    }


def collisions(figure: Figure) -> list[str]:
    """Texts that lie over one another, or outside the figure."""
    seen = texts(figure)
    width, height = figure.get_size_inches() * figure.dpi
    problems = [
        f"{text!r} beyond the figure"
        for text, box in seen
        if box.x0 < -SPARE or box.y0 < -SPARE or box.x1 > width + SPARE or box.y1 > height + SPARE
    ]
    for (one, a), (other, b) in combinations(seen, 2):
        across = min(a.x1, b.x1) - max(a.x0, b.x0)
        up = min(a.y1, b.y1) - max(a.y0, b.y0)
        if across > SPARE and up > SPARE:
            problems.append(f"{one!r} over {other!r}")
    return problems
