"""Diagnosis of a picture: undoes each likely mistake and measures the remaining difference."""

import math
from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from accuracy.comparison.blocks import Bias, bias
from accuracy.comparison.blurs import LEAST_FILTER, blur
from accuracy.comparison.compression import TRIED_SIDE, compressed, compression, palette
from accuracy.comparison.inputs import Picture
from accuracy.comparison.metrics import luma_of_seen
from accuracy.comparison.mistakes import Mistake, candidates
from accuracy.comparison.neighbours import neighbourhood
from accuracy.comparison.noise import sample_variances
from accuracy.comparison.pixels import bands, bordered_bands
from accuracy.comparison.ratings import MAX_RMSE_LEFT, Rating
from renderer.images.colors import linear_from_srgb, srgb_from_linear
from renderer.math.arrays import Floats, Masks

ROW_STEP = 4
"""Step between the rows that are compared first."""

INNER_ROWS = slice(1, -1)
FIRST_ROWS = slice(1, -1, ROW_STEP), INNER_ROWS
"""Rows and columns that are compared first, of a band with a row above and below."""

MAX_CAUSES = 3
"""Causes reported: those after the first are other corrections with a similar result."""

MAX_RMSE_RATIO = 1.25
"""Other causes are reported only if they leave at most this many times the RMSE of the first."""

JAGGED = "antialiasing_missing"

JAGGED_HINT = (
    "Edges are jagged: each pixel shows one side of an edge, where the reference shows how much of each it "
    "covers. Take the mean of several camera samples over the pixel's square."
)

BLURRED = "blurred"

BLURRED_HINT = (
    "Edges are softer than the reference's, as after a Gaussian of {:g} pixels. A blur does not replace "
    "samples: take the mean of several camera samples over each pixel's own square, and filter nothing "
    "afterwards."
)

FILTERED = "pixel_filter"

FILTERED_HINT = (
    "Each pixel shows more than its own square, as with a tent or a Gaussian as pixel filter. Take the mean "
    "of samples over the pixel's own square."
)

LOSSY = "lossy_compression"

LOSSY_HINT = (
    "The picture was stored with lossy compression (JPEG, WebP) before it became this file. Store it as PNG."
)

PALETTE = "palette"

PALETTE_HINT = (
    "The picture has {} colours, its reference {}: a palette, as in GIF, has 256 at most. Store it as PNG "
    "with 24 bits, NPY or EXR."
)

STORED = LOSSY, PALETTE

STORED_REASON = "Storing the picture lost so much that it looks noisier than it is: its format is the reason."

AVERAGED = "averaged_after_encoding"

AVERAGED_HINT = (
    "Pixels are darker where their samples differ: samples were encoded before their mean was taken. Take "
    "the mean of linear values, then encode it."
)

Rows = Callable[[slice], Floats]
"""A picture: some rows of it, (h, W, 3)."""

PREDICTED = AVERAGED, FILTERED, LOSSY
"""Mistakes that are recognized by their effect on the reference."""

MIN_EDGE_STEP = 0.2
"""Least step of displayed brightness, 0..1, that counts as an edge."""

MIN_MIXED_DISTANCE = 0.2
"""A pixel shows both sides if it differs from each by more than this share of the step."""

MIN_MIXED_SHARE = 0.6
"""Anti-aliasing is missing if the picture has less than this share of the reference's pixels that show both
sides. Without it textures and penumbrae still give some; 4 samples a pixel give most."""

ONE_SIDED = 0.35
"""Least mean squared error of these pixels, relative to showing one side: one sample in the middle has 0.45
or more, four random ones 0.25. Edges along the rows of a 2 x 2 grid give few such pixels, too, but at most
0.3."""

MIN_MIXED_PIXELS = 16
"""Anti-aliasing is not judged if fewer pixels of the reference show both sides."""


@dataclass(frozen=True, slots=True)
class Cause:
    """A mistake that explains most of a difference.

    Attributes
    ----------
    cause, hint : str
    rmse_before, rmse_after : float
        Linear, without the outermost pixels, before and after the mistake is undone; equal if it cannot be.
    """

    cause: str
    hint: str
    rmse_before: float
    rmse_after: float

    @property
    def is_undone(self) -> bool:
        """Whether the picture is closer without it; else it is only named."""
        return self.rmse_after < self.rmse_before


def diagnose(image: Picture, reference: Picture, tolerance: float, most_bias: float) -> tuple[Cause, ...]:
    """Mistakes that explain the difference of two pictures of a size, the best explanation first.

    Parameters
    ----------
    tolerance
        Mean difference of a block, linear, that is always tolerated.
    most_bias
        Share of biased blocks with which two pictures still agree.

    Returns
    -------
    tuple of Cause
        Empty if no single mistake explains it, or there is nothing to explain.
    """
    if min(image.size) < 3:
        return ()
    trial = _Trial(image, reference, tolerance, most_bias)
    found = [cause for mistake in trial.nearer() if (cause := trial.of(mistake)) is not None]
    return best(found or trial.edges() or trial.blurs())


def best(causes: Iterable[Cause]) -> tuple[Cause, ...]:
    """The causes that leave least, each once, the best one first."""
    ordered, first = sorted(causes, key=lambda cause: cause.rmse_after), dict[str, Cause]()
    for cause in ordered:
        if cause.rmse_after <= MAX_RMSE_RATIO * ordered[0].rmse_after:
            first.setdefault(cause.cause, cause)
    return tuple(first.values())[:MAX_CAUSES]


class _Trial:
    """A picture and its reference, with intermediate results that all mistakes share."""

    def __init__(self, image: Picture, reference: Picture, tolerance: float, most_bias: float) -> None:
        self._image, self._reference = image, reference
        self._tolerance, self._most_bias = tolerance, most_bias

    def nearer(self) -> list[Mistake]:
        """Mistakes whose undoing brings a part of the rows no farther from the reference."""
        tried = list(candidates(self._image, self._reference))
        glances = np.zeros(len(tried) + 1)
        for rows in self._bordered():
            image = self._image.pixels.part(rows).linear
            wanted = self._reference.pixels.part(rows).linear[1:-1, 1:-1]
            seen = [image[FIRST_ROWS], *(self._glance(each, rows, image) for each in tried)]
            glances += [_square(undone - wanted[::ROW_STEP]) for undone in seen]
        return [each for each, left in zip(tried, glances[1:], strict=True) if left <= glances[0]]

    def _glance(self, mistake: Mistake, rows: slice, image: Floats) -> Floats:
        if mistake.turns:
            turned = self._image.pixels.turned(mistake.undo)
            return turned.part(slice(rows.start + 1, rows.stop - 1, ROW_STEP), INNER_ROWS).linear
        return mistake.undo(image)[FIRST_ROWS] if mistake.moves else mistake.undo(image[FIRST_ROWS])

    def of(self, mistake: Mistake) -> Cause | None:
        """The cause of the difference, if this mistake explains it."""
        control = mistake.control
        fair = self._undone(replace(mistake, undo=control, turns=False) if control else None)
        return self._cause(mistake.cause, mistake.hint, self._undone(mistake), fair)

    def edges(self) -> list[Cause]:
        """Missing anti-aliasing, which no change of the picture undoes."""
        left = jagged_left_over(self._image, self._reference)
        if left is None or math.sqrt(left) > MAX_RMSE_LEFT * self.rmse:
            return []
        return [Cause(JAGGED, JAGGED_HINT, self.rmse, math.sqrt(left))]

    def blurs(self) -> list[Cause]:
        """A blur, which is reproduced with the reference."""
        found = blur(self._image, self._reference)
        if found is None:
            return []
        return self.of_effect(BLURRED, BLURRED_HINT.format(found.width), found.effect.__getitem__)

    def of_effect(self, cause: str, hint: str, effect: Rows) -> list[Cause]:
        """A mistake that adds an effect to the rows of the reference, if it explains the picture."""
        as_it_is = self._undone(None)
        found = self._cause(cause, hint, lambda rows: np.asarray(as_it_is(rows) - effect(rows)), as_it_is)
        return [] if found is None else [found]

    def _cause(self, cause: str, hint: str, undone: Rows, fair: Rows) -> Cause | None:
        """The cause, if the picture is much closer without it than a fair alternative."""
        rating = Rating.of(self._left(undone, fair))
        if not rating.is_clear and not (rating.is_sure and self._agrees(undone)):
            return None
        return Cause(cause, hint, self.rmse, math.sqrt(rating.left))

    @cached_property
    def rmse(self) -> float:
        """RMSE of the unchanged picture."""
        bands = self._left(self._undone(None))
        squares, values = np.sum([(_square(left), left.size) for left, _ in bands], axis=0)
        return math.sqrt(squares / values)

    def _bordered(self) -> Iterator[slice]:
        return bordered_bands(self._image.height, self._image.width)

    def _undone(self, mistake: Mistake | None) -> Rows:
        """Rows of the picture without a mistake."""
        pixels = self._image.pixels
        if mistake is None:
            return lambda rows: pixels.part(rows).linear
        if mistake.turns:
            pixels = pixels.turned(mistake.undo)
            return lambda rows: pixels.part(rows).linear

        def undo(rows: slice) -> Floats:
            # Rows beside a band may be moved into it.
            above = min(rows.start, 1)
            around = slice(rows.start - above, rows.stop + 1)
            return mistake.undo(pixels.part(around).linear)[above : above + rows.stop - rows.start]

        return undo

    def _left(self, *pictures: Rows) -> Iterator[tuple[Floats, ...]]:
        """Differences of pictures from the reference, and the allowed one, without the outermost pixels."""
        for rows in self._bordered():
            wanted, allowed = self._reference.pixels.part(rows).linear, self._allowed(rows)
            yield tuple(each[1:-1, 1:-1] for each in (*(p(rows) - wanted for p in pictures), allowed))

    def _agrees(self, undone: Rows) -> bool:
        parts = [bias(*band) for band in self._left(undone)]
        return Bias.joined(parts).share <= self._most_bias

    def _allowed(self, rows: slice) -> Floats:
        image, reference = self._image.pixels.part(rows), self._reference.pixels.part(rows)
        return np.asarray(image.rounding + reference.rounding + self._tolerance)


def predicted(image: Picture, reference: Picture, tolerance: float, most_bias: float) -> tuple[Cause, ...]:
    """A mistake whose effect on the reference, whose errors are known, explains the picture.

    A lossy format is named even if it does not explain the picture.
    """
    if min(image.size) < 3:
        return ()

    def average(rows: slice) -> Floats:
        above = min(rows.start, 1)
        around = reference.part(slice(rows.start - above, rows.stop + 1))
        return (_averaged_encoded(around) - around.linear)[above : above + rows.stop - rows.start]

    trial = _Trial(image, reference, tolerance, most_bias)
    # Compression leaves thousands of colours.
    found = trial.of_effect(AVERAGED, AVERAGED_HINT, average) or [*_reduced(image, reference)]
    if not found and (effect := effect_of(LOSSY, image, reference)) is not None:
        found = trial.of_effect(LOSSY, LOSSY_HINT, effect.__getitem__)
        found = found or [Cause(LOSSY, LOSSY_HINT, trial.rmse, trial.rmse)]
    return tuple(found)


def stored_or_filtered(image: Picture, reference: Picture) -> tuple[Cause, ...]:
    """A lossy format or the pixel filter that explains the noise of a picture; empty where neither shows."""
    if named := _reduced(image, reference):
        return named
    seen, wanted = image.linear, reference.linear
    for cause, hint in ((LOSSY, LOSSY_HINT), (FILTERED, FILTERED_HINT)):
        if (effect := effect_of(cause, image, reference)) is not None:
            expected = wanted, wanted + effect
            return (Cause(cause, hint, *(math.sqrt(float(np.mean((seen - e) ** 2))) for e in expected)),)
    return ()


def _reduced(image: Picture, reference: Picture) -> tuple[Cause, ...]:
    """A palette, whose losses cannot be undone."""
    colors = palette(image.linear, reference.linear)
    if colors is None:
        return ()
    rmse = math.sqrt(float(np.mean((image.linear - reference.linear) ** 2)))
    return (Cause(PALETTE, PALETTE_HINT.format(*colors), rmse, rmse),)


def effect_of(cause: str, image: Picture, reference: Picture) -> Floats | None:
    """Effect of a mistake of `PREDICTED` on a reference, linear (H, W, 3); None if the picture shows none."""
    if cause == AVERAGED:
        return _averaged_encoded(reference) - reference.linear
    if cause == LOSSY:
        setting = compression(image.part(slice(TRIED_SIDE), slice(TRIED_SIDE)).linear)
        return None if setting is None else compressed(reference.linear, setting) - reference.linear
    found = blur(image, reference, LEAST_FILTER)
    return None if found is None else found.effect


def _averaged_encoded(reference: Picture) -> Floats:
    """A reference whose errors are `known`, as if its samples had been encoded first, linear (H, W, 3).

    A pixel's samples are assumed to have two values, with its mean and variance. The brighter one is that of
    the brightest neighbour, as at an edge, or one deviation above the mean, as in a penumbra.
    """
    mean, variance = reference.linear, sample_variances(reference)
    bright = np.minimum(np.maximum(neighbourhood(mean)[1], mean + np.sqrt(variance)), 1)
    # Quotients without a value are those of pixels that do not vary, which are not used.
    with np.errstate(divide="ignore", invalid="ignore"):
        dark = np.clip(mean - variance / (bright - mean), 0, 1)
        share = (mean - dark) / (bright - dark)
    codes = share * srgb_from_linear(bright) + (1 - share) * srgb_from_linear(dark)
    return np.where(variance > 0, linear_from_srgb(np.clip(codes, 0, 1)), mean)


def _square(difference: Floats) -> float:
    """Sum of squares."""
    # Without BLAS, whose threads cost more than they save on half a processor.
    return float((difference * difference).sum())


def jagged_left_over(image: Picture, reference: Picture) -> float | None:
    """Mean square that remains if each pixel may take the value of any neighbour; None for soft edges.

    A picture without anti-aliasing is then right everywhere.
    """
    soft = count = 0
    errors = one_sided = beyond = 0.0
    for inner, one, other in _around(image, reference):
        seen, wanted = luma_of_seen(one.pixels.seen), luma_of_seen(other.pixels.seen)
        low, high = neighbourhood(wanted)
        edges: Masks = (high - low > MIN_EDGE_STEP)[inner]
        both = edges & _between(wanted, low, high)[inner]
        count += int(np.count_nonzero(both))
        soft += int(np.count_nonzero(edges & _between(seen, *neighbourhood(seen))[inner]))
        errors += float(np.sum((seen - wanted)[inner][both] ** 2))
        one_sided += float(np.sum(((wanted - low) * (high - wanted))[inner][both]))
        beyond += _square((one.linear - np.clip(one.linear, *neighbourhood(other.linear)))[inner])
    if count < MIN_MIXED_PIXELS or soft >= MIN_MIXED_SHARE * count or errors < ONE_SIDED * one_sided:
        return None
    return beyond / (3 * image.width * image.height)


def has_soft_edges(picture: Picture) -> bool:
    """Whether enough pixels show both sides of an edge to judge anti-aliasing by them."""
    count = 0
    for inner, _, part in _around(picture, picture):
        seen = luma_of_seen(part.pixels.seen)
        low, high = neighbourhood(seen)
        count += int(np.count_nonzero(((high - low > MIN_EDGE_STEP) & _between(seen, low, high))[inner]))
    return count >= MIN_MIXED_PIXELS


def _around(image: Picture, reference: Picture) -> Iterator[tuple[slice, Picture, Picture]]:
    """Bands of two pictures, with a row above and below if there is one, and the slice of their own rows."""
    for first, last in bands(image.height, image.width):
        above = min(first, 1)
        rows = slice(first - above, last + 1)
        yield slice(above, above + last - first), image.part(rows), reference.part(rows)


def _between(values: Floats, low: Floats, high: Floats) -> Masks:
    margin = MIN_MIXED_DISTANCE * (high - low)
    return (values > low + margin) & (values < high - margin)
