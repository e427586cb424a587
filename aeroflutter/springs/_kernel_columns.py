"""Columns of a piece table, one row a mode, by name: for kernels and for everyone else."""

from __future__ import annotations

SLOPE, OFFSET, HELD = 0, 1, 2  # F = slope y + offset - held h
LOW, HIGH, MOVES = 3, 4, 5  # edges of y: low + moves h and high + moves h
FLOOR, CEILING = 6, 7  # range of the memory; at an end of it the edge beyond is gone
DIRECTION = 8  # in which y must go, or 0
TO_LOW, TO_HIGH, TO_TURN = 9, 10, 11  # the mode after each edge and after y turned back
SLIDES, LAG = 12, 13  # 1 where h = y - lag follows y
PIECE = 14  # place of the slope among the distinct ones
JUMPS = 15  # 1 where F jumps at the edges
BRANCH = 16  # what the memory is called on a side that y does not tell, or 0
HOLDS = 17  # 1 where F is whatever keeps y at its edge; the edges are then those of F
COLUMNS = 18

STICK, RISING, FALLING = 0, 1, 2  # modes of a loop
