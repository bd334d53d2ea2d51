"""The pixels that a test compares: a rectangle, a mask or both, and which of them are evidence.

Undoing a mistake takes evidence away: values divided by an exposure are as coarse as their codes, what was
too bright for the file may have been anything, and a picture without anti-aliasing may take any value between
its neighbours'. A block of 8 x 8 pixels is evidence where a picture of one colour, as white as this one where
this one is white, would be seen to be wrong with the same undone in it, and where rounding stays below the
tolerance that separates right from wrong. Other blocks say nothing, neither for the picture nor against it.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from accuracy.comparison import Picture
from accuracy.comparison.blocks import BLOCK_SIDE, bias, gathered
from renderer.math.arrays import Floats, Masks
from schemas.api.comparisons import ComparisonRegion
from service.grading.errors import BrokenTestError

Region = tuple[int, int, int, int]

LEAST_EVIDENCE = 0.5
"""Share of the blocks that tell the reference from one colour which must still do so after undoing."""


@dataclass(frozen=True, slots=True, eq=False)
class Selection:
    """The selected pixels.

    Attributes
    ----------
    region : tuple of int
        x0, y0, x1, y1 of their bounding rectangle, half open, rows from the top.
    pixels : (y1 - y0, x1 - x0) bool or None
        Which pixels of the rectangle count; None for all.
    """

    region: Region
    pixels: Masks | None

    @property
    def blocks(self) -> float:
        """Share of the rectangle's blocks with selected pixels."""
        if self.pixels is None:
            return 1.0
        return float((gathered(self.pixels.astype(np.float64)) > 0).any(axis=2).mean())

    def among(self, pixels: Masks) -> Selection:
        """Selection of the pixels that are also among `pixels` of the whole picture, (H, W)."""
        x0, y0, x1, y1 = self.region
        inside = pixels[y0:y1, x0:x1]
        return replace(self, pixels=inside if self.pixels is None else self.pixels & inside)

    def mask(self, picture: Picture) -> Masks:
        """The selected pixels of the whole picture, (H, W)."""
        x0, y0, x1, y1 = self.region
        chosen = np.zeros((picture.height, picture.width), dtype=bool)
        chosen[y0:y1, x0:x1] = True if self.pixels is None else self.pixels
        return chosen

    def pair(self, image: Picture, reference: Picture) -> tuple[Picture, Picture]:
        """Both pictures cropped; pixels that do not count are copied from the reference."""
        x0, y0, x1, y1 = self.region
        image, reference = (each.part(slice(y0, y1), slice(x0, x1)) for each in (image, reference))
        if self.pixels is not None:
            chosen = np.where(self.pixels[:, :, None], image.linear, reference.linear)
            image = image.with_values(chosen, image.rounding)
        return image, reference

    def counted(self, values: Floats) -> Floats:
        """The selected pixels of (h, w, 3), as one row of a picture: (1, N, 3)."""
        return values.reshape(1, -1, 3) if self.pixels is None else values[self.pixels][None]

    def moved(self, region: ComparisonRegion) -> ComparisonRegion:
        """A region of the rectangle in coordinates of the whole picture."""
        x, y = self.region[:2]
        places = {"x0": region.x0 + x, "x1": region.x1 + x, "y0": region.y0 + y, "y1": region.y1 + y}
        return region.model_copy(update=places)


def select(reference: Picture, region: Region | None, mask: Picture | None) -> Selection:
    """Select the pixels that count.

    Raises
    ------
    BrokenTestError
        The rectangle reaches beyond the picture, the mask has another size, or no pixel is selected.
    """
    size = f"The reference has {reference.width} x {reference.height} pixels"
    region = region or (0, 0, reference.width, reference.height)
    if region[2] > reference.width or region[3] > reference.height:
        raise BrokenTestError(f"{size}; the region {list(region)} reaches beyond.")
    if mask is None:
        return Selection(region, None)
    if mask.size != reference.size:
        raise BrokenTestError(f"{size}; the mask {mask.name} has {mask.width} x {mask.height}.")
    chosen = np.zeros((reference.height, reference.width), dtype=bool)
    inside = slice(region[1], region[3]), slice(region[0], region[2])
    chosen[inside] = (mask.linear[inside] > 0).any(axis=2)
    rows, columns = np.flatnonzero(chosen.any(axis=1)), np.flatnonzero(chosen.any(axis=0))
    if not rows.size:
        raise BrokenTestError(f"The mask {mask.name} is black everywhere in the region.")
    smallest = int(columns[0]), int(rows[0]), int(columns[-1]) + 1, int(rows[-1]) + 1
    return Selection(smallest, chosen[smallest[1] : smallest[3], smallest[0] : smallest[2]])


@dataclass(frozen=True, slots=True, eq=False)
class Evidence:
    """Pixels (H, W) that are evidence: wanted in a right picture, and left in this one after undoing."""

    wanted: Masks
    left: Masks

    def is_enough(self, selected: Masks) -> bool:
        """Whether enough of the selected pixels (H, W) is left to judge a picture."""
        left = int(np.count_nonzero(self.left & selected))
        return left > 0 and left >= LEAST_EVIDENCE * int(np.count_nonzero(self.wanted & selected))


def evidence(
    handed_in: Picture,
    undone: Picture,
    reference: Picture,
    undo: Callable[[Floats], Floats],
    tolerance: float,
) -> Evidence:
    """Find the blocks that are evidence.

    Parameters
    ----------
    handed_in, undone
        The picture with its mistakes and without them.
    undo
        Undoes the same in the values (H, W, 3) of another picture.
    tolerance
        Difference of a block's mean that is no reason, linear.
    """
    white = handed_in.linear >= 1
    plain = np.where(white, 1.0, np.median(handed_in.linear, axis=(0, 1)))
    expected = np.median(reference.linear, axis=(0, 1)) - reference.linear
    wanted, left = (
        bias(difference, rounding + reference.rounding + tolerance).blocks
        for difference, rounding in (
            (expected, reference.rounding),
            (undo(plain) - reference.linear, undone.rounding),
        )
    )
    left &= (gathered(undone.rounding).mean(axis=2) <= tolerance).all(axis=2)
    return Evidence(*(_pixels(blocks, white.shape[:2]) for blocks in (wanted, left)))


def _pixels(blocks: Masks, shape: tuple[int, ...]) -> Masks:
    """The pixels (H, W) of chosen blocks (rows, columns)."""
    row, column = (
        np.minimum(np.arange(n) // BLOCK_SIDE, m - 1) for n, m in zip(shape, blocks.shape, strict=True)
    )
    return np.asarray(blocks[row[:, None], column])
