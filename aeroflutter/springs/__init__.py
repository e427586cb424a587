"""Structural springs in pitch, as immutable laws; memory is data passed in and out."""

from aeroflutter.springs.base import Describing, Pieces, PiecewiseLinear, Spring, respond
from aeroflutter.springs.friction import Friction
from aeroflutter.springs.hysteresis import Hysteresis
from aeroflutter.springs.piece_table import PieceTable
from aeroflutter.springs.play import Play
from aeroflutter.springs.polynomial import Polynomial
from aeroflutter.springs.relay import Relay
from aeroflutter.springs.several import Springs, alone, each
from aeroflutter.springs.simplify import simplify, straight
from aeroflutter.springs.static import (
    Bilinear,
    Cubic,
    DeadZone,
    Freeplay,
    Linear,
    Saturation,
    Table,
)

__all__ = [
    "Bilinear",
    "Cubic",
    "DeadZone",
    "Describing",
    "Freeplay",
    "Friction",
    "Hysteresis",
    "Linear",
    "PieceTable",
    "Pieces",
    "PiecewiseLinear",
    "Play",
    "Polynomial",
    "Relay",
    "Saturation",
    "Spring",
    "Springs",
    "Table",
    "alone",
    "each",
    "respond",
    "simplify",
    "straight",
]
