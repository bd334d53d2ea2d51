"""Rays on their way to be cast."""

from __future__ import annotations

from typing import Any

import numpy.typing as npt


def rows(origins: npt.ArrayLike, directions: npt.ArrayLike) -> dict[str, Any]:
    """Origins and directions (rays, 3) as lists of numbers, as a request has them.

    Raises
    ------
    ValueError
        One has another shape, or does not hold real numbers.
    """
    # Not before somebody casts rays: a client needs nothing of the renderer otherwise.
    from renderer.math.arrays import vectors  # noqa: PLC0415

    given = {"origins": origins, "directions": directions}
    return {name: vectors(name, values).tolist() for name, values in given.items()}
