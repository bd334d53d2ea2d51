"""Batches of tiles: the pixels of one response, as arrays."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np
import numpy.typing as npt

from schemas.api.batches import FLOAT32, TileHead, unpack
from service.client.errors import UnexpectedAnswerError

Encoding = Literal["float32", "rgb8"]
"""Linear RGB as float32, or RGB as displayed in 8 bits."""


@dataclass(frozen=True, slots=True, eq=False)
class TilePixels:
    """A tile and the mean of all samples that it has so far.

    Attributes
    ----------
    head
        The tile: half-open rectangle in pixels of the whole picture, rows from the top.
    pixels
        Shape (ceil(height / stride), ceil(width / stride), 3): float32 linear RGB, or uint8 as displayed.
        With a stride above 1 each value stands for a block of stride x stride pixels.
    """

    head: TileHead
    pixels: npt.NDArray[np.float32] | npt.NDArray[np.uint8]

    def paint(self, canvas: npt.NDArray[np.float32] | npt.NDArray[np.uint8]) -> None:
        """Paint the tile into a picture of shape (height, width, 3)."""
        head = self.head
        canvas[head.y0 : head.y1, head.x0 : head.x1] = self.enlarged()

    def enlarged(self) -> npt.NDArray[np.float32] | npt.NDArray[np.uint8]:
        """One value for each pixel of the tile, shape (y1 - y0, x1 - x0, 3)."""
        head = self.head
        blocks = np.repeat(np.repeat(self.pixels, head.stride, axis=0), head.stride, axis=1)
        return blocks[: head.y1 - head.y0, : head.x1 - head.x0]


@dataclass(frozen=True, slots=True)
class PixelBatch:
    """Tiles in the order in which they are painted.

    Attributes
    ----------
    next
        The number to continue from.
    complete
        The job has ended and nothing follows.
    succeeded
        It has ended with an image.
    """

    tiles: tuple[TilePixels, ...]
    next: int
    complete: bool
    succeeded: bool


def decode_batch(data: bytes) -> PixelBatch:
    """Decode a binary batch without copying its pixels.

    Raises
    ------
    UnexpectedAnswerError
        The bytes are not such a batch.
    """
    try:
        head, tiles = unpack(data)
        number = np.dtype("<f4") if head.encoding == FLOAT32 else np.dtype("u1")
        painted = tuple(TilePixels(tile, _pixels(tile, raw, number)) for tile, raw in tiles)
    except ValueError as error:
        raise UnexpectedAnswerError(f"The batch of tiles is malformed: {error}") from error
    return PixelBatch(painted, head.next, head.complete, head.succeeded)


def _pixels(tile: TileHead, raw: memoryview, number: np.dtype[np.generic]) -> npt.NDArray[np.float32]:
    rows, columns = (-(-side // tile.stride) for side in (tile.y1 - tile.y0, tile.x1 - tile.x0))
    pixels: npt.NDArray[np.float32] = np.frombuffer(raw, dtype=number).reshape(rows, columns, 3)
    return pixels
