"""Axis-aligned boxes."""

from dataclasses import dataclass

from renderer.math.arrays import Floats


@dataclass(frozen=True, slots=True, eq=False)
class Boxes:
    """K boxes.

    Attributes
    ----------
    low, high : (3, K) float64
    """

    low: Floats
    high: Floats

    @classmethod
    def around(cls, corners: Floats) -> "Boxes":
        """Around K hulls given by corners (V, 3, K)."""
        return cls(corners.min(axis=0), corners.max(axis=0))
