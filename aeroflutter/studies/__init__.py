"""Studies made of many analyses: maps, sweeps, families, tolerances."""
