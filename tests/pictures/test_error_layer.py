"""The layer `error`: the standard error by the variance of the camera samples, in every engine."""

from fractions import Fraction

import numpy as np
import pytest
from numpy.typing import NDArray

import renderer
from renderer.layers import Moments, merged, standard_errors
from schemas.tiles import Pass, Tile
from tests.documents import Json, camera, phong, rectangle, sampled, scene
from tests.pictures import pictures
from tests.pictures.parts import samples_of


def plan_with_errors(document: Json) -> renderer.RenderPlan:
    return renderer.compile_scene(document, layers=["error"])


def record(*samples: float) -> NDArray[np.float64]:
    """The record of one pixel with equal channels."""
    moments = Moments(Tile(0, 0, 0, 1, 1), Pass(1, 1, 0, len(samples)))
    moments.add(np.array([0]), np.array([0]), np.tile(np.array(samples), (3, 1)))
    return moments.record


def exactly(samples: list[float]) -> float:
    """Standard error of the mean in rational arithmetic."""
    values = [Fraction(sample) for sample in samples]
    mean = sum(values) / len(values)
    squares = sum((value - mean) ** 2 for value in values)
    return float(squares / (len(values) * (len(values) - 1))) ** 0.5


@pytest.mark.parametrize(("pattern", "samples"), [("random", 25), ("sobol", 4), ("rotated", 4)])
def test_error_is_the_standard_error(pattern: str, samples: int) -> None:
    """To the half spacing of float32, and the rounding of a variance of 0."""
    light = "uniform" if pattern == "rotated" else pattern
    plan = plan_with_errors(pictures.of_room(sampling=sampled(samples, 4, pattern, light)))
    values = samples_of(plan)
    expected = values.std(axis=2, ddof=1) / np.sqrt(samples)
    found = renderer.render(plan).layers["error"]
    assert found.dtype == np.float32
    assert np.all(np.abs(found - expected) <= 2.0**-24 * expected + 2.0**-48)
    assert np.count_nonzero(found) > found.size / 4


@pytest.mark.parametrize(
    "samples",
    [
        [0.1, 0.7, 0.2, 0.2, 0.9, 0.4],
        [1e6 + x for x in (0.125, 0.25, 0.5, 0.75, 0.875, 1.0)],
        [1e-30, 3e-30, 2e-30, 5e-30, 1e-30, 4e-30],
    ],
    ids=["plain", "far from 0", "dark"],
)
def test_records_merge(samples: list[float]) -> None:
    whole = merged(merged(record(*samples[:1]), record(*samples[1:4])), record(*samples[4:]))
    assert whole[6, 0, 0] == 6
    assert abs(standard_errors(whole)[0, 0, 0] - exactly(samples)) <= 2.0**-23 * exactly(samples)


@pytest.mark.parametrize("value", [0.1, 1e30, 1e-300])
def test_equal_samples_have_no_error(value: float) -> None:
    whole = merged(record(value), record(*[value] * 3))
    whole = merged(whole, record(*[value] * 12))
    assert not standard_errors(whole).any()


def test_one_sample_has_an_unknown_error() -> None:
    plan = plan_with_errors(pictures.of_room(sampling=sampled(1, 1)))
    assert np.all(renderer.render(plan).layers["error"] == np.inf)


def test_bright_samples_leave_no_nan() -> None:
    """Two samples: half their distance."""
    most = np.finfo(np.float32).max
    assert np.all(standard_errors(record(np.inf, np.inf)) == 0)
    assert np.all(standard_errors(merged(record(0.0), record(1e300))) == most / 2)


def test_error_of_random_samples_is_honest() -> None:
    """Two by two fields of a board in each pixel: each sample is 0 or 1 with probability 1/2.

    So the square of the error is 1/64 in the mean. Over 2,048 pixels the mean of s^2 has a standard deviation
    of 0.00051, and that of (mean - 1/2)^2 one of 0.00047; six of them are passed once in 500 million times.
    """
    document = scene(
        rectangle([-6, -3, 0], [12, 0, 0], [0, 6, 0]),
        camera=camera(position=[0, 0, 3], look_at=[0, 0, 0], vertical_fov=90, width=64, height=32),
        ambient=[1, 1, 1],
        textures={"board": {"type": "checker", "even": [0, 0, 0], "odd": [1, 1, 1], "repeat": [128, 64]}},
        materials={"plain": phong(color_texture="board", ambient=1, diffuse=0)},
        sampling=sampled(16, 1, "random", seed=2),
    )
    result = renderer.render(plan_with_errors(document))
    said = np.mean(result.layers["error"][..., 0].astype(np.float64) ** 2)
    was = np.mean((result.image[..., 0] - 0.5) ** 2)
    assert abs(said - 1 / 64) <= 6 * 0.00051 / 16
    assert abs(was - 1 / 64) <= 6 * 0.00047
