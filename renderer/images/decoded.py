"""Decoded picture files: numbers as stored, and their meaning."""

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from renderer.assets import AssetError

DAMAGED = "The picture is damaged. Save it again as PNG or JPEG."

ALPHA = "Its alpha is not used: all of the texture is opaque."
"""Note on a picture of which some pixel is not opaque."""


@dataclass(frozen=True, slots=True, eq=False)
class DecodedImage:
    """A picture as stored.

    Attributes
    ----------
    values : (H, W, 3) float32
        Row 0 on top. Whole numbers are divided by the largest, so they are in 0..1; floating-point numbers
        are finite but not bounded. Grey is repeated, alpha is dropped.
    floating : bool
        Whether the file stores floating-point numbers, which are linear light by convention.
    notes : tuple of str
        Sentences about parts of the file that are not used, or were chosen.
    """

    values: NDArray[np.float32]
    floating: bool = False
    notes: tuple[str, ...] = ()


def of_codes(codes: NDArray[Any], largest: int, notes: tuple[str, ...] = ()) -> DecodedImage:
    """The picture of whole numbers (H, W) or (H, W, 3) from 0 to `largest`."""
    values = np.divide(codes, np.float32(largest), dtype=np.float32)
    return DecodedImage(_three(values), notes=notes)


def of_light(values: NDArray[np.floating], notes: tuple[str, ...] = ()) -> DecodedImage:
    """The picture of floating-point numbers (H, W) or (H, W, 3).

    Raises
    ------
    AssetError
        If one of them is NaN or infinite as float32.
    """
    with np.errstate(over="ignore"):
        light = _three(values.astype(np.float32, copy=False))
    bad = ~np.isfinite(light).all(axis=2)
    if bad.any():
        row, column = (int(index[0]) for index in np.nonzero(bad))
        raise AssetError(
            f"The pixel in column {column}, row {row} is NaN or infinite ({np.count_nonzero(bad)} such "
            "pixels). Save the picture with finite numbers."
        )
    return DecodedImage(light, floating=True, notes=notes)


def _three(values: NDArray[np.float32]) -> NDArray[np.float32]:
    return np.repeat(values[:, :, None], 3, axis=2) if values.ndim == 2 else values
