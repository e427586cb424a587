"""The thesis again: every figure and table whose parameters are known, by its own number."""

from aeroflutter.reproduce.catalogue import EXHIBITS, Exhibit, choose
from aeroflutter.reproduce.press import Printed, reproduce

__all__ = ["EXHIBITS", "Exhibit", "Printed", "choose", "reproduce"]
