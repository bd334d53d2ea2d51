"""Pictures with random patterns agree with a picture that samples densely and regularly.

A pixel's deviation is measured on independent seeds. With T pixels compared, the threshold is where one right
renderer in a thousand would fail: 4.9 standard errors of the mean for a thousand pixels, times 1.5 since the
standard error itself is estimated, plus what the dense picture is off by.
"""

from functools import cache

import numpy as np
import pytest
from numpy.typing import NDArray

from schemas.quality import Antialiasing, FixedQuality, LightSampling
from tests.documents import Json, camera, sampled
from tests.pictures import pictures
from tests.pictures.parts import image_of

SEEDS = 24
SCENE = pictures.of_room(camera=camera(width=12, height=8))
Picture = NDArray[np.float64]


def averaged(document: Json, *sampling: int | str) -> tuple[Picture, Picture]:
    """Mean and standard error over seeds, a pixel."""
    samplings = [sampled(*sampling, seed=seed) for seed in range(SEEDS)]  # type: ignore[arg-type]
    images = np.array([image_of(document | {"sampling": each}) for each in samplings], dtype=np.float64)
    return images.mean(axis=0), images.std(axis=0, ddof=1) / np.sqrt(SEEDS)


@pytest.mark.slow
@pytest.mark.parametrize("pattern", ["random", "stratified", "sobol"])
def test_random_places_average_to_the_pixel(pattern: str) -> None:
    document = SCENE | {"lights": [pictures.CEILING_LAMP]}
    mean, error = averaged(document, 16, 4, pattern)
    dense = FixedQuality(
        mode="fixed",
        antialiasing=Antialiasing(pattern="uniform", samples=1024),
        light=LightSampling(pattern="uniform", samples=4),
    )
    difference = np.abs(mean - image_of(document, dense))
    assert (difference <= 1.5 * 4.9 * error + 1 / 64).all()
    assert error.max() > 0


@cache
def of_light_points(light: str) -> tuple[Picture, Picture]:
    return averaged(SCENE, 1, 16, "center", light)


@pytest.mark.parametrize("light", ["random", "stratified", "sobol"])
def test_random_light_points_average_to_the_light(light: str) -> None:
    mean, error = of_light_points(light)
    dense = FixedQuality(mode="fixed", light=LightSampling(pattern="uniform", samples=4096))
    difference = np.abs(mean - image_of(SCENE | {"sampling": sampled(1, 1, "center")}, dense))
    assert (difference <= 1.5 * 4.9 * error + 1 / 128).all()
    rms, of_random = (float(np.sqrt(np.mean(e**2))) for e in (error, of_light_points("random")[1]))
    assert 0 < rms < (1.01 if light == "random" else 0.7) * of_random


@pytest.mark.slow
def test_neighbouring_pixels_err_independently() -> None:
    """Errors of points of a light at neighbours, over seeds: no correlation beyond 5 standard errors."""
    samplings = [sampled(1, 4, "center", "random", seed) for seed in range(200)]
    images = np.array([image_of(SCENE | {"sampling": each})[..., 0] for each in samplings])
    deviation = images.std(axis=0)
    noisy = deviation > 1e-3
    errors = (images - images.mean(axis=0)) / np.where(noisy, deviation, 1)
    pairs = noisy[:, :-1] & noisy[:, 1:]
    products = (errors[:, :, :-1] * errors[:, :, 1:])[:, pairs]
    assert pairs.sum() > 20
    assert abs(products.mean()) <= 5 / np.sqrt(products.size)
