"""Orders of convergence agree with theory, and errors of a study are unbiased.

Each threshold fails one right renderer in a million: 4.9 standard deviations, bounded from pixels that err
independently.
"""

import math
from collections.abc import Callable
from functools import cache

import numpy as np
import pytest

from accuracy.statistics import clipped
from accuracy.study import curves
from accuracy.study.reference import Reference
from renderer.film import Image
from schemas.quality import FixedQuality
from tests.documents import Json, camera, lamp, rectangle, scene, triangle
from tests.pictures.parts import image_of

ONE_IN_A_MILLION = 4.9
SEEDS = range(1, 5)
COUNTS = (4, 16, 64, 256)
SMOOTH = scene(
    rectangle([-20, 0, -20], [0, 0, 40], [40, 0, 0]),
    camera=camera(position=[0, 5, 0.1], look_at=[0, 0, 0]),
    lights=[lamp([-1, 2, -1], [2, 0, 0], [0, 0, 2], falloff="physical", visible=False)],
)
"""A floor under a lamp, without an edge or a shadow: what it gets from a point of the lamp is smooth."""
EDGES = scene(
    triangle([-2.3, 0.1, 0], [2.1, 0.4, 0], [-0.7, 3.2, 0]),
    triangle([0.4, 3.1, 0], [2.6, 1.2, 0], [2.2, 3.4, 0]),
    camera=camera(width=48, height=32),
    background=[0.9, 0.9, 0.9],
    ambient=[1, 1, 1],
)
"""Flat triangles of one colour: each pixel is a share of its area."""


def picture(document: Json, camera_samples: tuple[str, int], light: tuple[str, int], seed: int) -> Image:
    names = zip(("antialiasing", "light"), (camera_samples, light), strict=True)
    quality = {name: {"pattern": pattern, "samples": samples} for name, (pattern, samples) in names}
    return image_of(document | {"sampling": {"seed": seed}}, FixedQuality.model_validate(quality))


def on_light(pattern: str, count: int, seed: int) -> Image:
    return picture(SMOOTH, ("center", 1), (pattern, count), seed)


def on_edges(pattern: str, count: int, seed: int) -> Image:
    return picture(EDGES, (pattern, count), ("sobol", 1), seed)


@cache
def reference(drawn: Callable[[str, int, int], Image], samples: int) -> Reference:
    return Reference(*(clipped(drawn("sobol", samples, seed)) for seed in (91, 92)))


@cache
def order(drawn: Callable[[str, int, int], Image], pattern: str) -> tuple[float, float]:
    """The order of errors in the number of samples, as the study fits it, and 4.9 deviations of it."""
    judge = reference(drawn, 4096 if drawn is on_light else 1024).judge
    judged = {count: [judge(drawn(pattern, count, seed)) for seed in SEEDS] for count in COUNTS}
    errors = {count: np.mean([one.mse for one in found]) for count, found in judged.items()}
    rows = [
        {"rays": count, "rmse_255": {"estimate": 255 * math.sqrt(mse)}, "resolved": True}
        for count, mse in errors.items()
    ]
    fitted = curves.order(rows, curves.rays)
    assert fitted is not None
    places = np.log(list(judged))
    weights = (places - places.mean()) / np.sum((places - places.mean()) ** 2)
    # The root of a mean square is off by half of what that is off by, relative to it.
    offs = [
        math.sqrt(sum(one.by_pixels**2 for one in found)) / len(found) / (2 * errors[count])
        for count, found in judged.items()
    ]
    return fitted.estimate, ONE_IN_A_MILLION * float(np.sqrt(np.sum((weights * offs) ** 2)))


@pytest.mark.slow
@pytest.mark.parametrize("drawn", [on_light, on_edges])
def test_order_of_independent_samples_is_a_half(drawn: Callable[[str, int, int], Image]) -> None:
    value, room = order(drawn, "random")
    assert abs(value + 1 / 2) <= room


@pytest.mark.slow
@pytest.mark.parametrize(
    ("drawn", "pattern", "bound"),
    [
        (on_light, "stratified", -0.9),
        (on_light, "sobol", -1.0),
        (on_edges, "stratified", -0.6),
        (on_edges, "sobol", -0.6),
    ],
)
def test_order_of_well_spread_samples_is_steeper(
    drawn: Callable[[str, int, int], Image], pattern: str, bound: float
) -> None:
    """In theory -1 and, for scrambled nets, nearly -3/2 (Owen 1997); -3/4 at edges."""
    value, room = order(drawn, pattern)
    assert value + room < bound


def test_coarse_reference_gives_the_error_of_a_fine_one() -> None:
    """Half of the coarse one has an eighth of the samples of the picture, and errs more than it."""
    image = on_edges("sobol", 32, 1)
    coarse = reference(on_edges, 4)
    rough, known = coarse.judge(image), reference(on_edges, 256).judge(image)
    band = ONE_IN_A_MILLION * math.hypot(rough.by_reference, known.by_reference)
    assert coarse.own_mse > known.mse
    assert abs(rough.mse - known.mse) <= band
    # With the coarse reference's own error it would be outside.
    assert coarse.own_mse > band


def test_error_of_independent_samples_is_their_variance() -> None:
    """A pixel with the share p of an edge has the variance p (1 - p) of its contrast, over the number."""
    known = reference(on_edges, 256)
    inside, outside = np.array([0.16, 0.14, 0.12]), 0.9
    share = ((outside - known.mean) / (outside - inside)).mean(axis=2)
    expected = float(np.mean(share * (1 - share)) * np.mean((outside - inside) ** 2)) / 4
    judged = [known.judge(on_edges("random", 4, seed)) for seed in range(1, 17)]
    deviation = math.sqrt(sum(one.by_pixels**2 for one in judged)) / len(judged)
    assert deviation < 0.1 * expected
    assert abs(np.mean([one.mse for one in judged]) - expected) <= ONE_IN_A_MILLION * deviation
