"""Pictures side by side: as displayed, what they are off by, and a part of them enlarged."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from accuracy.study.reference import Reference, clipped
from renderer.images.files import encode_png
from schemas.display import Display

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from numpy.typing import NDArray

    from renderer.math.arrays import Floats

GAIN = 16
"""Times that differences are enlarged: one step of 8 bits is then 16, which is seen beside grey."""

DETAIL = 8
"""Parts of the shorter side that the enlarged part takes one of."""

LARGE = 256
"""Pixels of the enlarged part, at least."""


@dataclass(frozen=True, slots=True)
class Views:
    """One picture in three ways, each as a PNG file.

    Attributes
    ----------
    whole, difference, detail : bytes
        As displayed; the difference from the reference, `GAIN` times enlarged around grey; a part of
        the first whose pixels are enlarged.
    """

    whole: bytes
    difference: bytes
    detail: bytes


def views(images: Sequence[NDArray[Any]], reference: Reference, display: Display) -> list[Views]:
    """All pictures, and the reference last; the enlarged part is where they are off most, the same for all.

    Parameters
    ----------
    images : sequence of (H, W, 3)
        Linear.
    reference : Reference
    display : Display
        The scene's.
    """
    mean = reference.mean
    squares = sum(
        (np.sum((clipped(image) - mean) ** 2, axis=2) for image in images), np.zeros(mean.shape[:2])
    )
    part = worst_part(squares, max(4, min(mean.shape[:2]) // DETAIL))
    return [_views(image, mean, display, part) for image in (*images, mean)]


def worst_part(squares: Floats, side: int) -> tuple[slice, slice]:
    """Rows and columns of the square with that side, on a grid of half of it, that has the largest sum.

    Examples
    --------
    >>> squares = np.zeros((8, 8))
    >>> squares[5, 2] = 1
    >>> worst_part(squares, 4)
    (slice(2, 6, None), slice(0, 4, None))
    """
    height, width = squares.shape
    step = max(1, side // 2)
    corners = [
        (y, x)
        for y in range(0, max(1, height - side + 1), step)
        for x in range(0, max(1, width - side + 1), step)
    ]
    y, x = max(corners, key=lambda corner: squares[corner[0] :, corner[1] :][:side, :side].sum())
    return slice(y, y + side), slice(x, x + side)


def _views(image: NDArray[Any], mean: Floats, display: Display, part: tuple[slice, slice]) -> Views:
    difference = 0.5 + GAIN * (clipped(image) - mean)
    detail = image[part]
    times = -(-LARGE // max(detail.shape[:2]))
    return Views(
        whole=encode_png(image, display),
        difference=encode_png(difference, Display(transfer="linear")),
        detail=encode_png(np.repeat(np.repeat(detail, times, axis=0), times, axis=1), display),
    )


def file_names(name: str) -> Mapping[str, str]:
    """Names of the three files of a method.

    Examples
    --------
    >>> file_names("sobol")["detail"]
    'sobol-detail.png'
    """
    return {"whole": f"{name}.png", "difference": f"{name}-difference.png", "detail": f"{name}-detail.png"}
