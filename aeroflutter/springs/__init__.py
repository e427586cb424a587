"""Structural springs in pitch, as immutable laws; memory is data passed in and out."""

from aeroflutter.springs.base import Describing, Pieces, PiecewiseLinear, Spring, respond
from aeroflutter.springs.hysteresis import Hysteresis
from aeroflutter.springs.piece_table import PieceTable
from aeroflutter.springs.several import Springs, alone, each
from aeroflutter.springs.simplify import simplify, straight
from aeroflutter.springs.static import Bilinear, Cubic, Freeplay, Linear, Table

__all__ = [
    "Bilinear",
    "Cubic",
    "Describing",
    "Freeplay",
    "Hysteresis",
    "Linear",
    "PieceTable",
    "Pieces",
    "PiecewiseLinear",
    "Spring",
    "Springs",
    "Table",
    "alone",
    "each",
    "respond",
    "simplify",
    "straight",
]
