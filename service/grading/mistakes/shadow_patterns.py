"""Detect mistakes of shadows by their patterns: banding in penumbrae, and shadow acne.

Penumbrae have bands where every pixel uses the same few light samples. With acne surfaces shadow themselves
at random, as rounding decides.
"""

from __future__ import annotations

import numpy as np

import renderer
from accuracy.comparison.diagnosis import Cause
from renderer.cameras import build_pinhole
from renderer.math.arrays import Floats, Masks
from renderer.scenes import LoadedScene
from schemas.quality import Antialiasing, LightSampling
from service.grading.mistakes.hints import HINTS
from service.grading.mistakes.reproductions import quality_of

BANDS, ACNE = "light_points_shared", "shadow_acne"

POINTS = 64
"""Light samples used to find the penumbrae."""

WITHIN = 0.8
"""Least share of the squared difference that must lie in penumbrae."""

ALIKE = 0.5
"""Least correlation between neighbouring differences in a penumbra; noise has about 0."""

FEWEST = 64
"""Fewest pixels in penumbrae, or pairs of neighbours; a correlation of 64 has a standard deviation of 1/8."""

BRIGHT = 0.05
"""Least direct light of a pixel, as a mean of channels, that shows how much of it arrives."""

WHITE = 0.98
"""Brighter channels may be clipped, so their share of the light is unknown."""

SMOOTH = 0.1
"""Neighbours are compared where their direct light differs by no more than this share."""

MOST = 0.9
"""Largest mean share of the light that arrives; about half of it does."""

LEAST = 0.1
"""Smallest one: darker pictures lack the light."""

SAMPLES = 100
"""The spread of neighbours must be at least that of so many shadow rays a pixel, each blocked at random;
quantisation and correct sampling spread far less where the light is fully visible."""

LEFT = 0.75
"""Largest share of the RMSE that may remain; 4 rays a pixel of which 3 arrive leave 0.65."""

MEDIAN = 0.6745 * 2**0.5
"""Median absolute difference of two independent normal numbers of variance 1."""


def bands(scene: LoadedScene, image: Floats, reference: Floats) -> Cause | None:
    """The cause, if the difference of two linear pictures (H, W, 3) lies in penumbrae and is smooth there.

    `rmse_after` is the RMSE of the difference minus its local mean.
    """
    if not any(light.type == "rectangle" for light in scene.document.lights):
        return None
    inside = penumbrae(scene)
    difference = (image - reference).mean(axis=2)
    squares = difference * difference
    if np.count_nonzero(inside) < FEWEST or squares[inside].sum() < WITHIN * squares.sum():
        return None
    if _correlation(difference, inside) < ALIKE:
        return None
    colors = image - reference
    return _cause(BANDS, colors, colors - _mean_around(colors))


def penumbrae(scene: LoadedScene) -> Masks:
    """Pixels whose centre sees a light partially occluded, (H, W) bool."""
    points = LightSampling(pattern="uniform", samples=POINTS)
    quality = quality_of(scene, Antialiasing(pattern="center", samples=1), points)
    camera = scene.document.camera
    eye = build_pinhole(camera)
    y, x = np.mgrid[: camera.height, : camera.width].reshape(2, -1) + 0.5
    directions = eye.directions(x, y).T
    origins = np.broadcast_to(eye.position.T, directions.shape)
    seen = renderer.trace(renderer.compile_scene(scene, quality), origins, directions).visibility
    partly: Masks = ((seen > 0) & (seen < 1)).any(axis=1).reshape(camera.height, camera.width)
    return partly


def _correlation(difference: Floats, inside: Masks) -> float:
    """Correlation of horizontal and vertical neighbours that both lie inside."""
    products, squares = 0.0, 0.0
    for before, after in ((np.s_[:, :-1], np.s_[:, 1:]), (np.s_[:-1], np.s_[1:])):
        both = inside[before] & inside[after]
        a, b = difference[before][both], difference[after][both]
        products += float((a * b).sum())
        squares += float((a * a + b * b).sum()) / 2
    return products / squares if squares > 0 else 0.0


def _mean_around(values: Floats) -> Floats:
    """Means of 3 x 3 pixels, (H, W, 3); border pixels are repeated."""
    padded = np.pad(values, ((1, 1), (1, 1), (0, 0)), mode="edge")
    means: Floats = np.lib.stride_tricks.sliding_window_view(padded, (3, 3), (0, 1)).mean(axis=(-2, -1))
    return means


def acne(dark: Floats, image: Floats, reference: Floats) -> Cause | None:
    """The cause, if a random share of the direct light is missing nearly everywhere.

    Parameters
    ----------
    dark
        The scene without its lights.
    image, reference
        All three are linear, (H, W, 3).

    Notes
    -----
    `rmse_after` is the RMSE that remains if each pixel receives the mean share of its surroundings.
    """
    direct = (reference - dark).mean(axis=2)
    lit = (direct > BRIGHT) & (np.maximum(image, reference).max(axis=2) < WHITE)
    share = np.divide((image - dark).mean(axis=2), direct, out=np.zeros_like(direct), where=lit)
    first, second = _neighbours(share, direct, lit)
    if first.size < FEWEST:
        return None
    mean = float((first.mean() + second.mean()) / 2)
    # By the median: in a penumbra, correct pixels spread as well.
    noise = float(np.median(np.abs(first - second)) / MEDIAN) ** 2
    if not LEAST < mean < MOST or noise < mean * (1 - mean) / SAMPLES:
        return None
    left = image - (dark + _around(share, lit)[:, :, None] * (reference - dark))
    found = _cause(ACNE, image - reference, left)
    return found if found.rmse_after < LEFT * found.rmse_before else None


def _neighbours(share: Floats, direct: Floats, lit: Masks) -> tuple[Floats, Floats]:
    """Shares of horizontal neighbours on which the same light falls, (N,) each."""
    left, right = direct[:, :-1], direct[:, 1:]
    alike = lit[:, :-1] & lit[:, 1:] & (np.abs(left - right) <= SMOOTH * np.minimum(left, right))
    return share[:, :-1][alike], share[:, 1:][alike]


def _around(share: Floats, lit: Masks) -> Floats:
    """Mean shares over the lit ones of 5 x 5 pixels, (H, W); 1 where none is lit."""
    total, count = _boxes(np.where(lit, share, 0)), _boxes(lit.astype(np.float64))
    return np.divide(total, count, out=np.ones_like(total), where=count > 0)


def _boxes(values: Floats) -> Floats:
    """Sums over 5 x 5 pixels, (H, W)."""
    sums: Floats = np.lib.stride_tricks.sliding_window_view(np.pad(values, 2), (5, 5)).sum(axis=(2, 3))
    return sums


def _cause(name: str, difference: Floats, left: Floats) -> Cause:
    """A cause by the difference that it explains, and what is left of that."""
    before, after = (float(np.sqrt(np.mean(part * part))) for part in (difference, left))
    return Cause(name, HINTS[name], before, after)
