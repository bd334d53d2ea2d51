"""Buffers that are reused for every block, so that pair work stays in cache and allocates no memory."""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from renderer.math.arrays import Masks, Pairs

PAIRS_AT_ONCE = 262144
"""Pairs of point and light point processed at once: 1 MiB per array, the fastest size with 64 and with 256
light points on a core with 2 MiB of second-level cache."""

FEWEST_POINTS = 64
"""Below this, calls cost more than what the cache gives."""


class Workspace:
    """Named scratch arrays; the same name returns the same memory."""

    def __init__(self) -> None:
        self._buffers: dict[tuple[str, str], NDArray[Any]] = {}

    def pairs(self, name: str, rows: int, count: int, dtype: np.dtype[np.floating]) -> Pairs:
        """A (rows, count) array of floats with undefined content."""
        return self._buffer(name, rows, count, dtype)

    def like(self, name: str, other: Pairs) -> Pairs:
        """An array with the shape and dtype of another."""
        return self._buffer(name, other.shape[0], other.shape[1], other.dtype)

    def masks(self, name: str, rows: int, count: int) -> Masks:
        """A (rows, count) boolean array with undefined content."""
        return self._buffer(name, rows, count, np.dtype(np.bool_))

    def _buffer(self, name: str, rows: int, count: int, dtype: np.dtype[Any]) -> NDArray[Any]:
        key = (name, dtype.char)
        buffer = self._buffers.get(key)
        if buffer is None or buffer.size < rows * count:
            buffer = self._buffers[key] = np.empty(rows * count, dtype=dtype)
        return buffer[: rows * count].reshape(rows, count)
