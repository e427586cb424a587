"""Limit cycles by describing functions, harmonic balance and shooting, and their continuation."""
