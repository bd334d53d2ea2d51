"""Vectors as structures of arrays: shape (3, N), one contiguous row a coordinate.

Products are written out by components. A BLAS call may add in another order when the number of
columns changes, and then a pixel would depend on the tile it was rendered in.
"""

from collections.abc import Sequence
from typing import TypeVar

import numpy as np
from numpy.typing import ArrayLike, NDArray

Floats = NDArray[np.float64]
"""float64 array."""
Pairs = NDArray[np.floating]
"""float32 or float64 array of pair work, by the plan's precision."""
Integers = NDArray[np.int64]
"""int64 array."""
Masks = NDArray[np.bool_]
"""Boolean array."""


Value = TypeVar("Value", bound=np.generic)


def dot(a: Floats, b: Floats) -> Floats:
    """Scalar products, (3, N) x (3, N) or (3, 1) -> (N,)."""
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


def cross(a: Floats, b: Floats) -> Floats:
    """Vector products, (3, N) x (3, N) or (3, 1) -> (3, N)."""
    return np.stack(
        (a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]),
    )


def unit(v: Floats) -> Floats:
    """Vectors of length 1, (3, N) -> (3, N); a zero vector stays zero.

    Divided by the largest component first, so that squares neither overflow nor vanish.
    Error at most 4 eps a component.
    """
    largest = np.maximum(np.maximum(np.abs(v[0]), np.abs(v[1])), np.abs(v[2]))
    scaled = v / np.where(largest > 0, largest, 1.0)
    length = np.sqrt(dot(scaled, scaled))
    return scaled / np.where(length > 0, length, 1.0)


def taken(v: NDArray[Value], index: Integers) -> NDArray[Value]:
    """Columns (..., M) of an array (..., N), row by row.

    `v[:, index]` would lay them out column by column, and take four times as long.
    """
    return np.take(v, index, axis=-1)


def put(v: NDArray[Value], index: Integers, columns: NDArray[Value]) -> None:
    """Set columns (R, M) of an array (R, N), a row at a time."""
    for row, values in zip(v, columns, strict=True):
        row[index] = values


def add(v: NDArray[Value], index: Integers, columns: NDArray[Value]) -> None:
    """Add to columns (R, M) of an array (R, N), each named once, a row at a time."""
    for row, values in zip(v, columns, strict=True):
        row[index] += values


def column(vector: Sequence[float]) -> Floats:
    """One vector as a (3, 1) array that broadcasts over N."""
    return np.array(vector, dtype=np.float64).reshape(3, 1)


def columns(vectors: Sequence[Sequence[float]]) -> Floats:
    """K vectors as a contiguous (3, K) array."""
    return np.ascontiguousarray(np.array(vectors, dtype=np.float64).reshape(-1, 3).T)


def stacked(vectors: Sequence[Sequence[Sequence[float]]]) -> Floats:
    """V vectors of R numbers of each of K things as a contiguous (V, R, K) array, (3, 3, 0) of none."""
    array = np.array(vectors, dtype=np.float64) if vectors else np.empty((0, 3, 3))
    return np.ascontiguousarray(array.transpose(1, 2, 0))


def lengths(v: Floats) -> Floats:
    """Euclidean lengths, (3, N) -> (N,), without overflow or underflow of the squares."""
    largest = np.maximum(np.maximum(np.abs(v[0]), np.abs(v[1])), np.abs(v[2]))
    scaled = v / np.where(largest > 0, largest, 1.0)
    return largest * np.sqrt(dot(scaled, scaled))


def magnitude(v: Floats) -> Floats:
    """Sum of the absolute components, (3, N) -> (N,): the scale that rounding errors follow."""
    return np.abs(v[0]) + np.abs(v[1]) + np.abs(v[2])


def vectors(name: str, values: ArrayLike) -> NDArray[np.float64]:
    """A caller's N vectors as an array (N, 3) of float64; an empty list is no vectors.

    Raises
    ------
    ValueError
        If it has another shape or does not hold real numbers; the message begins with `name`.
    """
    try:
        array = np.asarray(values)
        # Text and booleans would silently become numbers, and complex numbers lose a part.
        real = array.dtype.kind in "fiu" or (array.dtype.kind == "O" and array.ndim > 0)
        array = array.astype(np.float64) if real else array
    except (OverflowError, TypeError, ValueError):
        real = False
    if not real:
        raise ValueError(f"{name} must be an array of real numbers of the shape (N, 3).")
    if array.shape == (0,):
        return np.empty((0, 3))
    if array.ndim != 2 or array.shape[1] != 3:
        raise ValueError(f"{name} must have the shape (N, 3), not {array.shape}.")
    return array
