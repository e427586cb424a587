"""Linear analyses: root locus and modes."""
