"""Case files: what is given, checked, and turned into a model, a spring and a start."""

from aeroflutter.case.case import Case, load_case

__all__ = ["Case", "load_case"]
