"""Mistakes of ray tracers: rendered on purpose, and compared with a submitted picture."""
