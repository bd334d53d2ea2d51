"""Vectors, rounding-error bounds and random numbers."""
