"""Where samples lie in the unit square: in a pixel, or on a light."""

from renderer.samplers.patterns import FIXED, PATTERNS, Pattern

__all__ = ["FIXED", "PATTERNS", "Pattern"]
