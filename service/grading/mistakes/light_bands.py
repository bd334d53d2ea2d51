"""Detect banding in penumbrae, caused by the same few light samples in every pixel."""

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

CAUSE = "light_points_shared"

POINTS = 64
"""Light samples used to find the penumbrae."""

WITHIN = 0.8
"""Least share of the squared difference that must lie in penumbrae."""

ALIKE = 0.5
"""Least correlation between neighbouring differences in a penumbra; noise has about 0."""

LEAST = 64
"""Fewest pixels in penumbrae; the correlation of 64 pixels has a standard deviation of 1/8."""


def bands(scene: LoadedScene, image: Floats, reference: Floats) -> Cause | None:
    """The cause, if the difference of two linear pictures (H, W, 3) lies in penumbrae and is smooth there.

    `rmse_after` is the RMSE of the difference minus its local mean.
    """
    if not any(light.type == "rectangle" for light in scene.document.lights):
        return None
    inside = penumbrae(scene)
    difference = (image - reference).mean(axis=2)
    squares = difference * difference
    if np.count_nonzero(inside) < LEAST or squares[inside].sum() < WITHIN * squares.sum():
        return None
    if _correlation(difference, inside) < ALIKE:
        return None
    colors = image - reference
    left = colors - _mean_around(colors)
    before, after = (float(np.sqrt(np.mean(part * part))) for part in (colors, left))
    return Cause(CAUSE, HINTS[CAUSE], before, after)


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
