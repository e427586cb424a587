"""Exact limit cycles of piecewise-linear springs: shooting and continuation (being built)."""
