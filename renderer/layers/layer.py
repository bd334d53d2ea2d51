"""What a layer is."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

from renderer.interaction import Points
from renderer.math.arrays import Floats, Integers
from schemas.tiles import Pass, Tile

Layers = dict[str, NDArray[Any]]
"""Layers by name, each (H, W) or (H, W, channels), float32 or int32; or what a tile has recorded for them."""


class Sampled(Protocol):
    """Takes the camera samples of a tile in a pass, as the film does."""

    record: Floats

    def add(self, columns: Integers, rows: Integers, radiance: Floats) -> None:
        """Take the samples (3, P * S) of P pixels, those of one pixel together, ordered by number."""
        ...


@dataclass(frozen=True, slots=True, eq=False)
class Statistic:
    """A layer that is formed from all camera samples.

    Attributes
    ----------
    of : callable
        Begins the record of a tile in a pass.
    merged : callable
        From the records of two sets of samples to that of both.
    finished : callable
        From a record to the layer.
    """

    of: Callable[[Tile, Pass], Sampled]
    merged: Callable[[Floats, Floats], Floats]
    finished: Callable[[Floats], NDArray[Any]]


@dataclass(frozen=True, slots=True, eq=False)
class Layer:
    """One number, or a few, about each pixel.

    Attributes
    ----------
    name, detail : str
    channels : tuple of str
        Names of its numbers. With one channel the layer has shape (H, W), else (H, W, channels).
    dtype : float32 or int32
    ground : float
        Value of a pixel whose ray meets no shape.
    values : callable or None
        From points (M) to their values, (M,) or (channels, M). None if every pixel has the value `ground`,
        or is formed from the camera samples, so that no ray is needed.
    statistic : Statistic or None
        How it is formed from camera samples, if it is. Then every pass records it, else the first alone.
    """

    name: str
    detail: str
    channels: tuple[str, ...]
    dtype: np.dtype[Any]
    ground: float
    values: Callable[[Points], NDArray[Any]] | None = None
    statistic: Statistic | None = None

    def recorded_in(self, pass_: Pass) -> bool:
        """Whether a pass records something for it."""
        return pass_.begins if self.statistic is None else pass_.stride == 1

    def blank(self, height: int, width: int) -> NDArray[Any]:
        """The layer of a picture that shows no shape."""
        shape = (height, width) if len(self.channels) == 1 else (height, width, len(self.channels))
        return np.full(shape, self.ground, dtype=self.dtype)
