"""The typical section drawn to scale: where its axes, its centre of mass and its springs are."""

from __future__ import annotations

from html import escape
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from aeroflutter.model.section import TypicalSection

__all__ = ["sketch"]

_CHORD = 150.0  # pixels a semi-chord
_LEFT, _MIDDLE = 60.0, 108.0  # leading edge and chord line
_THICKNESS = (0.2969, -0.1260, -0.3516, 0.2843, -0.1036)  # of a NACA four-digit section, closed


def sketch(section: TypicalSection, spring: str, at: str = "pitch") -> str:
    """An SVG of the section for a page; colours come from the page's style.

    Parameters
    ----------
    section : TypicalSection
    spring : str
        Kind of the nonlinear spring, for the description.
    at : str
        Its coordinate.
    """
    axis, mass = section.a_h, section.a_h + section.x_alpha
    words = (
        f"Airfoil section on a {_kind('heave', spring, at)}heave spring and a "
        f"{_kind('pitch', spring, at)}pitch spring, flow from the left. "
        f"Elastic axis {axis:g} semi-chords behind mid-chord, centre of mass "
        f"{section.x_alpha:g} behind the elastic axis."
    )
    if section.flap:
        words += (
            f" Flap on a {_kind('flap', spring, at)}spring, its hinge {section.flap.hinge:g} "
            "semi-chords behind mid-chord."
        )
    parts = [
        f'<svg viewBox="0 8 390 202" role="img" aria-labelledby="sketch-words" class="sketch">'
        f'<title id="sketch-words">{escape(words)}</title>',
        f'<path class="airfoil" d="{_airfoil()}"/>',
        _line(-1.0, 0.0, 1.0, 0.0, "chord"),
        _heave_spring(_x(axis)),
        _pitch_spring(_x(axis)),
        f'<circle class="mark solid" cx="{_x(axis):.1f}" cy="{_MIDDLE}" r="4.5"/>',
        *(_flap(section.flap.hinge) if section.flap else ()),
        _centre_of_mass(_x(mass)),
        '<path class="flow" d="M8 60h34m-7-4 7 4-7 4M8 156h34m-7-4 7 4-7 4"/>',
        '<text x="8" y="50">V</text>',
        *_dimensions(section),
        "</svg>",
    ]
    return "".join(parts)


def _kind(coordinate: str, spring: str, at: str) -> str:
    return f"{spring} " if coordinate == at else ""


def _flap(hinge: float) -> tuple[str, str]:
    """The hinge, and the flap's chord let down by a fifth of a radian, with its own spring."""
    x, length = _x(hinge), _CHORD * (1.0 - hinge)
    turn = np.linspace(0.0, 2.5 * np.pi, 40)
    radius = 3.0 + 0.9 * turn
    points = zip(x + radius * np.cos(turn), _MIDDLE + radius * np.sin(turn), strict=True)
    spiral = "L".join(f"{a:.1f} {b:.1f}" for a, b in points)
    return (
        f'<path class="spring" d="M{spiral}"/>',
        f'<path class="flap" d="M{x:.1f} {_MIDDLE}l{length * np.cos(0.2):.1f} '
        f'{length * np.sin(0.2):.1f}"/><circle class="mark" cx="{x:.1f}" cy="{_MIDDLE}" r="3"/>',
    )


def _x(semi_chords: float) -> float:
    """Abscissa of a place behind mid-chord."""
    return _LEFT + _CHORD * (1.0 + semi_chords)


def _line(x1: float, y1: float, x2: float, y2: float, name: str) -> str:
    return (
        f'<line class="{name}" x1="{_x(x1):.1f}" y1="{_MIDDLE + y1:.1f}" '
        f'x2="{_x(x2):.1f}" y2="{_MIDDLE + y2:.1f}"/>'
    )


def _airfoil() -> str:
    """Outline of a NACA 0012, closed at the trailing edge."""
    s = 0.5 * (1.0 - np.cos(np.linspace(0.0, np.pi, 40)))
    powers = (np.sqrt(s), s, s**2, s**3, s**4)
    half = 1.2 * _CHORD * np.asarray(_THICKNESS) @ np.array(powers)
    x = _LEFT + 2.0 * _CHORD * s
    upper = [f"{a:.1f} {_MIDDLE - b:.1f}" for a, b in zip(x[::-1], half[::-1], strict=True)]
    lower = [f"{a:.1f} {_MIDDLE + b:.1f}" for a, b in zip(x, half, strict=True)]
    return f"M{'L'.join(upper + lower)}Z"


def _heave_spring(x: float) -> str:
    """A zigzag from the elastic axis down to the ground."""
    top, turns = _MIDDLE + 28.0, 6
    zigzag = "".join(f"l{12 if n % 2 else -12} 7" for n in range(turns))
    ground = top + 12.0 + 7.0 * turns + 8.0
    return (
        f'<path class="spring" d="M{x:.1f} {_MIDDLE}V{top}l6 4{zigzag}l-6 4V{ground}"/>'
        f'<path class="ground" d="M{x - 22:.1f} {ground}h44'
        + "".join(f"M{x - 16 + 11 * n:.1f} {ground}l-6 7" for n in range(4))
        + '"/>'
    )


def _pitch_spring(x: float) -> str:
    """A spiral about the elastic axis."""
    turn = np.linspace(0.0, 4.5 * np.pi, 70)
    radius = 5.0 + 1.1 * turn
    points = zip(x + radius * np.cos(turn), _MIDDLE + radius * np.sin(turn), strict=True)
    return f'<path class="spring" d="M{"L".join(f"{a:.1f} {b:.1f}" for a, b in points)}"/>'


def _centre_of_mass(x: float) -> str:
    return (
        f'<circle class="mark" cx="{x:.1f}" cy="{_MIDDLE}" r="6"/>'
        f'<path class="solid" d="M{x:.1f} {_MIDDLE}v-6a6 6 0 0 1 6 6zM{x:.1f} {_MIDDLE}v6'
        'a6 6 0 0 1-6-6z"/>'
    )


def _dimensions(section: TypicalSection) -> list[str]:
    """Distances along the chord, each on a line of its own above the airfoil."""
    rows = (
        ("b", -1.0, 0.0, 22.0, "b"),
        (f"a_h b = {section.a_h:g} b", 0.0, section.a_h, 40.0, "a_h"),
        (
            f"x_α b = {section.x_alpha:g} b",
            section.a_h,
            section.a_h + section.x_alpha,
            68.0,
            "x_alpha",
        ),
    )
    return [_dimension(*row) for row in rows if abs(row[1] - row[2]) > 1e-9]


def _dimension(text: str, start: float, end: float, y: float, name: str) -> str:
    low, high = sorted((_x(start), _x(end)))
    anchor = (
        f'<text class="dimension-{name}" x="{high + 6:.1f}" y="{y + 4:.1f}">{escape(text)}</text>'
    )
    ends = f"M{low:.1f} {y - 4}v8M{high:.1f} {y - 4}v8M{low:.1f} {y}H{high:.1f}"
    return f'<path class="dimension" d="{ends}"/>{anchor}'
