"""Missing anti-aliasing: pixels at edges show one side or the other, where the reference shows both."""

import numpy as np

from renderer.math.arrays import Floats, Masks

CAUSE = "antialiasing_missing"
HINT = (
    "Edges are jagged: each pixel shows one side of an edge, where the reference shows how much of each it "
    "covers. Take the mean of several camera samples over the pixel's square."
)

EDGE = 0.2
"""Least step of brightness as seen, 0..1, that is taken for an edge."""

BETWEEN = 0.2
"""A pixel shows both sides if it is farther than this share of the step from either."""

FEW = 0.6
"""Anti-aliasing is missing where fewer than this share of the reference's pixels that show both sides do.

Without it textures and penumbrae still give some of them; with 4 samples a pixel most are there.
"""

LEAST = 16
"""Pixels of the reference that show both sides, below which nothing is said."""


def left_over(image: Floats, reference: Floats, seen: Floats, wanted: Floats) -> float | None:
    """Mean square that remains if pixels may show what any neighbour of theirs shows; None for soft edges.

    A picture without anti-aliasing is then right everywhere.

    Parameters
    ----------
    image, reference : (H, W, 3)
        Linear.
    seen, wanted : (H, W)
        Brightness of both as seen, 0 to 1.
    """
    low, high = neighbourhood(wanted)
    edges = high - low > EDGE
    soft = np.count_nonzero(edges & _between(wanted, low, high))
    if soft < LEAST or np.count_nonzero(edges & _between(seen, *neighbourhood(seen))) >= FEW * soft:
        return None
    least, most = neighbourhood(reference)
    beyond = image - np.clip(image, least, most)
    return float(np.mean(beyond * beyond))


def neighbourhood(values: Floats) -> tuple[Floats, Floats]:
    """Least and largest of each pixel and its eight neighbours, (H, W, ...) -> two of the same shape."""
    return _extreme(values, np.minimum), _extreme(values, np.maximum)


def _extreme(values: Floats, chosen: np.ufunc) -> Floats:
    tall = values.copy()
    chosen(tall[1:], values[:-1], out=tall[1:])
    chosen(tall[:-1], values[1:], out=tall[:-1])
    wide = tall.copy()
    chosen(wide[:, 1:], tall[:, :-1], out=wide[:, 1:])
    chosen(wide[:, :-1], tall[:, 1:], out=wide[:, :-1])
    return wide


def _between(values: Floats, low: Floats, high: Floats) -> Masks:
    margin = BETWEEN * (high - low)
    return (values > low + margin) & (values < high - margin)
