"""Axis-aligned boxes."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

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
    def none(cls) -> "Boxes":
        """No box."""
        return cls(np.zeros((3, 0)), np.zeros((3, 0)))

    @classmethod
    def joined(cls, parts: Sequence["Boxes"]) -> "Boxes":
        """All boxes of several."""
        return cls(
            np.concatenate([part.low for part in parts], axis=1),
            np.concatenate([part.high for part in parts], axis=1),
        )

    @classmethod
    def around(cls, corners: Floats) -> "Boxes":
        """Around K hulls given by corners (V, 3, K)."""
        return cls(corners.min(axis=0), corners.max(axis=0))

    @property
    def count(self) -> int:
        """Number of boxes K."""
        return self.low.shape[1]
