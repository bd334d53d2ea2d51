"""What the families of rays draw from: one seeded stream each, and numbers as scenes write them."""

import random

import numpy as np

from accuracy.hard_cases.documents import Json

Ray = tuple[list[float], list[float]]
"""Origin and direction."""
Case = tuple[Json, list[Ray]]
"""A shape, and rays to try on it."""


def vector(chosen: random.Random, reach: float = 1.0) -> list[float]:
    """A random place in a cube."""
    return [chosen.uniform(-reach, reach) for _ in range(3)]


def direction(chosen: random.Random) -> list[float]:
    """A random unit vector."""
    v = np.array([chosen.gauss(0, 1) for _ in range(3)])
    return [float(x) for x in v / np.linalg.norm(v)]


def listed(v: object) -> list[float]:
    """As a scene writes it."""
    return [float(x) for x in np.asarray(v)]
