"""Figures drawn from result objects; one file a kind of result, one style for all."""
