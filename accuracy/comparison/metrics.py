"""Metrics of the difference of two pictures: RMSE, PSNR, SSIM, FLIP and others.

All are of linear values clipped to 0..1, as the error of target quality is, and in float64.
"""

import math
from collections.abc import Sequence
from dataclasses import astuple, dataclass

import numpy as np

from renderer.errors import MissingExtraError
from renderer.images.colors import srgb_from_linear
from renderer.math.arrays import Floats
from renderer.math.numerics import EPS

RELATIVE_FLOOR = 0.01
"""Added to the squared reference in `relmse`, so that black pixels do not dominate (Rousselle et al.
2011)."""

ROUNDING_BOUND = 4 * EPS
"""Bound on the rounding of a subtraction and a division of values up to 1."""

SIDE, SIGMA = 11, 1.5
"""The window of the paper: a Gaussian of 11 x 11 pixels with standard deviation 1.5, which adds up to 1."""

STABILITY = (0.01**2, 0.03**2)
"""C1 and C2 of the paper for values 0..1."""

LUMA = (0.2126, 0.7152, 0.0722)
"""Weights of red, green and blue (ITU-R BT.709), applied to sRGB codes."""

PIXELS_PER_DEGREE = 67.0
"""Pixels in a degree of the field of view: a screen 0.7 m wide with 3840 pixels at 0.7 m, as in the paper."""


@dataclass(frozen=True, slots=True)
class Metrics:
    """Numbers about a picture a and its reference b, over all pixels and channels.

    Attributes
    ----------
    mse, rmse : float
        Mean of (a - b)^2, and its root.
    psnr : float
        -10 log10(mse), dB; inf for equal pictures.
    relmse : float
        Mean of (a - b)^2 / (b^2 + 0.01).
    max_abs : float
        Largest |a - b|.
    frac_over : float
        Share of pixels in which a channel differs by more than the limit.
    """

    mse: float
    rmse: float
    psnr: float
    relmse: float
    max_abs: float
    frac_over: float


def metrics(image: Floats, reference: Floats, limit: float) -> Metrics:
    """Metrics of linear pictures (H, W, 3), values 0..1.

    Parameters
    ----------
    limit
        Of `frac_over`. A difference equal to it up to rounding is not over it.

    Notes
    -----
    Sums are pairwise in float64: relative error below 64 eps for any picture that is accepted.
    """
    return Sums.of(image - reference, reference, limit).metrics()


@dataclass(frozen=True, slots=True)
class Sums:
    """Sums over pixels and channels of a band, from which the metrics of the whole picture follow."""

    pixels: int
    squares: float
    relative: float
    largest: float
    over: int

    @classmethod
    def of(cls, difference: Floats, reference: Floats, limit: float) -> "Sums":
        """Sums of a difference (H, W, 3) from a reference."""
        squares, apart = difference * difference, np.abs(difference)
        return cls(
            pixels=apart.shape[0] * apart.shape[1],
            squares=float(squares.sum()),
            relative=float((squares / (reference * reference + RELATIVE_FLOOR)).sum()),
            largest=float(apart.max()),
            over=int(np.count_nonzero((apart > limit + ROUNDING_BOUND).any(axis=2))),
        )

    @classmethod
    def joined(cls, parts: Sequence["Sums"]) -> "Sums":
        """Sums over all bands."""
        pixels, squares, relative, largest, over = zip(*map(astuple, parts), strict=True)
        return cls(sum(pixels), math.fsum(squares), math.fsum(relative), max(largest), sum(over))

    def metrics(self) -> Metrics:
        """The metrics of these pixels."""
        mse = self.squares / (3 * self.pixels)
        return Metrics(
            mse=mse,
            rmse=math.sqrt(mse),
            psnr=-10 * math.log10(mse) if mse > 0 else math.inf,
            relmse=self.relative / (3 * self.pixels),
            max_abs=self.largest,
            frac_over=self.over / self.pixels,
        )


def luma_of_seen(seen: Floats) -> Floats:
    """Brightness (H, W) of values as a display shows them, (H, W, 3); luminance of linear ones."""
    return seen[:, :, 0] * LUMA[0] + seen[:, :, 1] * LUMA[1] + seen[:, :, 2] * LUMA[2]


def ssim(image: Floats, reference: Floats) -> float | None:
    """Mean structural similarity of two pictures (H, W), values 0..1; at most 1, which means equal.

    Variances are those of the window's population. Only windows that lie whole in the picture count: their
    centres keep 5 pixels from each border. None for pictures with fewer than 11 pixels along a side.
    """
    found = Similarity()
    found.add(image, reference)
    return found.mean


class Similarity:
    """Mean structural similarity of two pictures that come in bands, from the top."""

    def __init__(self) -> None:
        self._above: tuple[Floats, ...] = ()
        self._sum, self._windows = 0.0, 0

    def add(self, image: Floats, reference: Floats) -> None:
        """Add the next rows (H, W) of both pictures, values 0..1."""
        rows: tuple[Floats, ...] = image, reference
        if self._above:
            rows = tuple(np.concatenate(both) for both in zip(self._above, rows, strict=True))
        if min(rows[0].shape) >= SIDE:
            similar = _similarities(*rows)
            self._sum, self._windows = self._sum + float(similar.sum()), self._windows + similar.size
        # Windows reach over the border of bands.
        self._above = tuple(values[-SIDE + 1 :] for values in rows)

    @property
    def mean(self) -> float | None:
        """As `ssim` states it."""
        return self._sum / self._windows if self._windows else None


def _similarities(image: Floats, reference: Floats) -> Floats:
    """Structural similarity of each window, (H, W) -> (H - 10, W - 10)."""
    mean_a, mean_b = _windowed(image), _windowed(reference)
    squares, product = mean_a * mean_a + mean_b * mean_b, mean_a * mean_b
    # The formula has the variances in their sum alone.
    variances = _windowed(image * image + reference * reference) - squares
    covariance = _windowed(image * reference) - product
    c1, c2 = STABILITY
    above = (2 * product + c1) * (2 * covariance + c2)
    below = (squares + c1) * (variances + c2)
    return np.asarray(above / below)


def window() -> Floats:
    """One side of the window, (11,); the window is its outer product with itself."""
    away = np.arange(SIDE) - SIDE // 2
    weights = np.exp(-(away * away) / (2 * SIGMA * SIGMA))
    return weights / weights.sum()


def _windowed(values: Floats) -> Floats:
    """Weighted means over all whole windows, (H, W) -> (H - 10, W - 10)."""
    return _along(_along(values, window()).T, window()).T


def _along(values: Floats, weights: Floats) -> Floats:
    rows = values.shape[0] - SIDE + 1
    half = SIDE // 2
    total = values[half : half + rows] * weights[half]
    # The window is symmetric: rows at the same distance share a weight.
    for step in range(half):
        mirrored = SIDE - 1 - step
        total += (values[step : step + rows] + values[mirrored : mirrored + rows]) * weights[step]
    return total


def flip(image: Floats, reference: Floats) -> float:
    """Mean LDR-FLIP of two linear pictures (H, W, 3) with values 0..1; 0 for equal ones, at most 1.

    In single precision, by the authors' own library.

    Raises
    ------
    MissingExtraError
        If that is not installed.
    """
    try:
        from flip_evaluator import evaluate  # noqa: PLC0415  an extra that most installations do without
    except ImportError as error:
        raise MissingExtraError(
            "FLIP needs the package flip-evaluator. Install it with: pip install 'penumbra-render[flip]'"
        ) from error

    seen = [srgb_from_linear(picture).astype(np.float32) for picture in (reference, image)]
    _, mean, _ = evaluate(*seen, "LDR", applyMagma=False, parameters={"ppd": PIXELS_PER_DEGREE})
    return float(mean)
