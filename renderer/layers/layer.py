"""What a layer is."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from renderer.interaction import Points

Layers = dict[str, NDArray[Any]]
"""Layers by name, each (H, W) or (H, W, channels), float32 or int32."""


@dataclass(frozen=True, slots=True)
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
        so that no ray is needed.
    """

    name: str
    detail: str
    channels: tuple[str, ...]
    dtype: np.dtype[Any]
    ground: float
    values: Callable[[Points], NDArray[Any]] | None

    def blank(self, height: int, width: int) -> NDArray[Any]:
        """The layer of a picture that shows no shape."""
        shape = (height, width) if len(self.channels) == 1 else (height, width, len(self.channels))
        return np.full(shape, self.ground, dtype=self.dtype)
