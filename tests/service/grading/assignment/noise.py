"""Noise as it is, and as it might be added to a wrong picture to hide what is wrong with it."""

from collections.abc import Callable
from functools import cache

import numpy as np

from scenes.make_assignment_parts import FOLDER
from tests.service.grading.assignment import program
from tests.service.grading.assignment.shapes import Array
from tests.service.grading.assignment.tracer import Tracer

POOL = 128
"""Samples of each pixel that pictures are made of: each picture takes its own part of them."""

Added = Callable[[Array, np.random.Generator], Array]
"""Adds noise to a linear picture (H, W, 3)."""


@cache
def sums(scene: str) -> Array:
    """Sums of the first 0, 1, ... samples of each pixel by the independent tracer, (2 POOL + 1, H, W, 3).

    After the last sample the first ones follow again.
    """
    draw = drawing(scene)
    samples = np.stack([draw() for _ in range(POOL)])
    twice = np.concatenate((np.zeros_like(samples[:1]), samples, samples))
    return np.cumsum(twice, axis=0, dtype=np.float64)


def drawing(scene: str) -> Callable[[], Array]:
    """A function that draws a picture of one random sample a pixel; pictures of normals end in `_normals`."""
    name = scene.removesuffix("_normals")
    tracer = Tracer(program.read(FOLDER, name), FOLDER)
    return lambda: tracer.normal_picture(1) if name != scene else tracer.picture(1)


def honest(scene: str, samples: int, seed: int) -> Array:
    """A linear picture of so many random samples; each pixel takes those after a random one of its pool."""
    kept = sums(scene)
    height, width = kept.shape[1:3]
    first = np.random.default_rng([seed, samples]).integers(POOL, size=(height, width))
    rows, columns = np.indices((height, width))
    return np.asarray((kept[first + samples, rows, columns] - kept[first, rows, columns]) / samples)


def gaussian(deviation: float) -> Added:
    return lambda picture, random: picture + deviation * random.standard_normal(picture.shape)


def uniform(deviation: float) -> Added:
    reach = deviation * 3**0.5
    return lambda picture, random: picture + random.uniform(-reach, reach, picture.shape)


def multiplied(deviation: float) -> Added:
    return lambda picture, random: picture * (1 + deviation * random.standard_normal(picture.shape))


def blue(deviation: float) -> Added:
    """Noise without low frequencies: its means over blocks are near 0."""

    def add(picture: Array, random: np.random.Generator) -> Array:
        white = random.standard_normal(picture.shape)
        around = (
            np.roll(white, 1, 0) + np.roll(white, -1, 0) + np.roll(white, 1, 1) + np.roll(white, -1, 1)
        ) / 4
        return picture + deviation * (white - around) / 1.25**0.5

    return add


def salted(share: float) -> Added:
    """As many pixels black as white."""

    def add(picture: Array, random: np.random.Generator) -> Array:
        drawn = random.random(picture.shape[:2])[:, :, None]
        return np.where(drawn < share / 2, 0.0, np.where(drawn < share, 1.0, picture))

    return add


def where(chosen: Array, add: Added) -> Added:
    """Noise in some pixels (H, W) only."""
    return lambda picture, random: np.where(chosen[:, :, None], add(picture, random), picture)


KINDS: dict[str, Added] = {
    **{f"Gaussian {deviation:g}": gaussian(deviation) for deviation in (0.02, 0.05, 0.1, 0.2)},
    **{f"uniform {deviation:g}": uniform(deviation) for deviation in (0.05, 0.1)},
    **{f"blue {deviation:g}": blue(deviation) for deviation in (0.05, 0.1)},
    **{f"multiplied by 1 +- {deviation:g}": multiplied(deviation) for deviation in (0.1, 0.3)},
    **{f"salt and pepper {share:g}": salted(share) for share in (0.02, 0.1, 0.25)},
}
"""Noise by name, with its deviation or the share of its pixels."""
