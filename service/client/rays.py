"""Rays on their way to be cast."""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt


def rows(origins: npt.ArrayLike, directions: npt.ArrayLike) -> dict[str, Any]:
    """Origins and directions (rays, 3) as lists of numbers, as a request has them."""
    given = {"origins": origins, "directions": directions}
    return {name: np.asarray(vectors, dtype=np.float64).tolist() for name, vectors in given.items()}
