"""Flutter maps: grid, cells and a store that survives (being built)."""
