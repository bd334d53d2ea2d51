"""Arrays of vectors."""

import numpy as np
import pytest

from renderer.math.arrays import unit


@pytest.mark.parametrize("exponent", [-1000, -600, 600, 1000])
def test_unit_vectors_at_any_scale(exponent: int) -> None:
    """Squares of these lengths vanish or overflow; a power of two changes no digit of what is right."""
    vectors = np.random.default_rng(1).normal(size=(3, 100))
    assert np.array_equal(unit(vectors * 2.0**exponent), unit(vectors))
    assert np.abs((unit(vectors) ** 2).sum(axis=0) - 1).max() <= 8 * np.finfo(np.float64).eps
