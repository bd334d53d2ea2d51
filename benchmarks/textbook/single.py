"""The numbers of the renderer in float32."""

from __future__ import annotations

import dataclasses
from typing import Any, TypeVar, cast

import numpy as np
from numpy.typing import NDArray

from renderer.integrator import workspace

SINGLE = np.dtype(np.float32)

Singles = NDArray[Any]
"""float32 array where the renderer has one of float64."""

STEP = 1e-4
"""What a textbook steps over at the start of a ray, whatever the unit, scene units."""

Value = TypeVar("Value")


def single(value: Value) -> Value:
    """A copy of an array, or of an object made of arrays, with float32 for float64."""
    return cast("Value", _single(value))


def _single(value: Any) -> Any:
    if isinstance(value, np.ndarray):
        return value.astype(SINGLE) if value.dtype == np.float64 else value
    if isinstance(value, tuple):
        return tuple(_single(part) for part in value)
    if dataclasses.is_dataclass(value) and not isinstance(value, type):
        return dataclasses.replace(value, **arguments(value))
    return value


def arguments(value: Any) -> dict[str, Any]:
    """What an object is made of, in float32: the arguments of a class derived from its own."""
    names = (item.name for item in dataclasses.fields(value) if item.init)
    return {name: _single(getattr(value, name)) for name in names}


def buffer(name: str, rows: int, count: int) -> Singles:
    """A (rows, count) buffer of this thread with undefined content."""
    return workspace().pairs(f"textbook {name}", rows, count, SINGLE)


def dot(a: Any, b: Any, out: Singles, spare: Singles) -> Singles:
    """Scalar products of whatever broadcasts to the shape of `out`, three components each."""
    np.multiply(a[0], b[0], out=out)
    for axis in (1, 2):
        np.multiply(a[axis], b[axis], out=spare)
        np.add(out, spare, out=out)
    return out


def normalised(vectors: Singles) -> Singles:
    """Vectors (3, N) over their lengths."""
    x, y, z = vectors
    return np.asarray(vectors / np.sqrt(x * x + y * y + z * z))
