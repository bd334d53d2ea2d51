"""Pictures with random patterns agree with a picture that samples densely and regularly.

A pixel's spread is measured on independent seeds. With T pixels compared, the threshold is where one right
renderer in a thousand would fail: 4.9 standard errors of the mean for a thousand pixels, times 1.5 since the
standard error itself is estimated, plus what the dense picture is off by.
"""

import numpy as np
import pytest
from numpy.typing import NDArray

from schemas.quality import Antialiasing, FixedQuality, LightSampling
from tests.documents import Json, camera, sampled
from tests.pictures import pictures
from tests.pictures.parts import image_of

SEEDS = 24
SCENE = pictures.of_room(camera=camera(width=12, height=8))


def averaged(document: Json, **sampling: object) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Mean and standard error over seeds, a pixel."""
    images = np.array(
        [image_of(document | {"sampling": sampled(**sampling, seed=seed)}) for seed in range(SEEDS)],  # type: ignore[arg-type]
        dtype=np.float64,
    )
    return images.mean(axis=0), images.std(axis=0, ddof=1) / np.sqrt(SEEDS)


def dense(document: Json, samples: int, points: int) -> NDArray[np.float64]:
    quality = FixedQuality(
        mode="fixed",
        antialiasing=Antialiasing(pattern="uniform", samples=samples),
        light=LightSampling(pattern="uniform", samples=points),
    )
    return image_of(document, quality).astype(np.float64)


@pytest.mark.slow
@pytest.mark.parametrize("pattern", ["random", "stratified", "sobol"])
def test_random_places_average_to_the_pixel(pattern: str) -> None:
    document = SCENE | {"lights": [pictures.CEILING_LAMP]}
    mean, error = averaged(document, samples=16, points=4, pattern=pattern)
    difference = np.abs(mean - dense(document, 1024, 4))
    assert (difference <= 1.5 * 4.9 * error + 1 / 64).all()
    assert error.max() > 0


@pytest.mark.parametrize("light", ["random", "stratified", "sobol"])
def test_random_light_points_average_to_the_light(light: str) -> None:
    mean, error = averaged(SCENE, samples=1, points=16, pattern="center", light=light)
    centred = SCENE | {"sampling": sampled(1, 1, "center")}
    quality = FixedQuality(mode="fixed", light=LightSampling(pattern="uniform", samples=4096))
    difference = np.abs(mean - image_of(centred, quality))
    assert (difference <= 1.5 * 4.9 * error + 1 / 128).all()
    assert error.max() > 0


@pytest.mark.slow
def test_stratified_points_leave_less_noise() -> None:
    noise = {
        light: averaged(SCENE, samples=1, points=16, pattern="center", light=light)[1]
        for light in ("random", "stratified", "sobol")
    }
    rms = {light: float(np.sqrt(np.mean(error**2))) for light, error in noise.items()}
    assert rms["stratified"] < 0.7 * rms["random"]
    assert rms["sobol"] < 0.7 * rms["random"]


@pytest.mark.slow
def test_neighbouring_pixels_err_independently() -> None:
    """Errors of points of a light at neighbours, over seeds: no correlation beyond 5 standard errors."""
    images = np.array(
        [
            image_of(SCENE | {"sampling": sampled(1, 4, "center", "random", seed)})[..., 0]
            for seed in range(200)
        ]
    )
    spread = images.std(axis=0)
    noisy = spread > 1e-3
    errors = (images - images.mean(axis=0)) / np.where(noisy, spread, 1)
    pairs = noisy[:, :-1] & noisy[:, 1:]
    products = (errors[:, :, :-1] * errors[:, :, 1:])[:, pairs]
    assert pairs.sum() > 20
    assert abs(products.mean()) <= 5 / np.sqrt(products.size)
