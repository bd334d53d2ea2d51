"""Evidence: the pixels that still tell right from wrong after mistakes of a picture were undone.

Undoing a mistake takes evidence away: values divided by an exposure are as coarse as their codes, what was
too bright for the file may have been anything, and a picture without anti-aliasing may take any value between
its neighbours'. A block of 8 x 8 pixels is evidence where a picture of one colour, as white as this one where
this one is white, would be seen to be wrong with the same undone in it, and where rounding stays below the
tolerance that separates right from wrong. Other blocks say nothing, neither for the picture nor against it.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from accuracy.comparison import Picture
from accuracy.comparison.blocks import BLOCK_SIDE, bias, gathered
from renderer.math.arrays import Floats, Masks

LEAST = 0.5
"""Share of the blocks that tell the reference from one colour which must still do so after undoing."""


@dataclass(frozen=True, slots=True, eq=False)
class Evidence:
    """Pixels (H, W) that are evidence: wanted in a right picture, and left in this one after undoing."""

    wanted: Masks
    left: Masks

    def is_enough(self, selected: Masks) -> bool:
        """Whether enough of the selected pixels (H, W) is left to judge a picture."""
        left = int(np.count_nonzero(self.left & selected))
        return left > 0 and left >= LEAST * int(np.count_nonzero(self.wanted & selected))


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
