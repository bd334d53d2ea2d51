"""What the study says of convergence is what theory says, and its errors are without bias.

Seeds are fixed. Each threshold would fail one right renderer in a million: 4.9 standard deviations, which are
bounded from the pixels of the pictures themselves, as these err independently.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cache

import numpy as np
import pytest

from accuracy.hard_cases.documents import Json, camera, lamp, phong, rectangle, scene, triangle
from accuracy.statistics import clipped
from accuracy.study import curves
from accuracy.study.reference import Judgement, Reference
from renderer.film import Image
from schemas.quality import FixedQuality
from tests.pictures.parts import image_of

ONE_IN_A_MILLION = 4.9
SEEDS = range(1, 5)
COUNTS = (4, 16, 64, 256)

SMOOTH = scene(
    rectangle([-20, 0, -20], [0, 0, 40], [40, 0, 0]),
    camera=camera(position=[0, 5, 0.1], look_at=[0, 0, 0]),
    materials={"plain": phong()},
    lights=[lamp([-1, 2, -1], [2, 0, 0], [0, 0, 2], falloff="physical", visible=False)],
)
"""A floor under a lamp, without an edge or a shadow: what it gets from a point of the lamp is smooth."""

EDGES = scene(
    triangle([-2.3, 0.1, 0], [2.1, 0.4, 0], [-0.7, 3.2, 0]),
    triangle([0.4, 3.1, 0], [2.6, 1.2, 0], [2.2, 3.4, 0]),
    camera=camera(width=48, height=32),
    materials={"plain": phong()},
    background=[0.9, 0.9, 0.9],
    ambient=[1, 1, 1],
    lights=[],
)
"""Flat triangles of one colour: each pixel is a share of its area."""


def picture(document: Json, pattern: str, samples: int, light: str, points: int, seed: int) -> Image:
    quality = FixedQuality.model_validate(
        {
            "mode": "fixed",
            "antialiasing": {"pattern": pattern, "samples": samples},
            "light": {"pattern": light, "samples": points},
        }
    )
    return image_of(document | {"sampling": {"seed": seed}}, quality)


@cache
def light_reference() -> Reference:
    return Reference(*(clipped(picture(SMOOTH, "center", 1, "sobol", 4096, seed)) for seed in (91, 92)))


@cache
def edge_reference(samples: int = 1024) -> Reference:
    return Reference(*(clipped(picture(EDGES, "sobol", samples, "sobol", 1, seed)) for seed in (91, 92)))


@dataclass(frozen=True)
class Order:
    """The fitted order, and the standard deviation that pixels give it."""

    value: float
    deviation: float

    def is_within(self, expected: float) -> bool:
        return abs(self.value - expected) <= ONE_IN_A_MILLION * self.deviation

    def is_steeper(self, than: float) -> bool:
        return self.value + ONE_IN_A_MILLION * self.deviation < than


def order(judged: dict[int, list[Judgement]]) -> Order:
    """The order of errors in the number of samples, as the study fits it."""
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
    return Order(fitted.estimate, float(np.sqrt(np.sum((weights * offs) ** 2))))


@cache
def order_on_lights(pattern: str) -> Order:
    judge = light_reference().judge
    return order(
        {
            count: [judge(picture(SMOOTH, "center", 1, pattern, count, seed)) for seed in SEEDS]
            for count in COUNTS
        }
    )


@cache
def order_on_edges(pattern: str) -> Order:
    judge = edge_reference().judge
    return order(
        {
            count: [judge(picture(EDGES, pattern, count, "sobol", 1, seed)) for seed in SEEDS]
            for count in COUNTS
        }
    )


def test_independent_points_of_a_light_converge_with_the_root_of_their_number() -> None:
    assert order_on_lights("random").is_within(-1 / 2)


def test_independent_camera_samples_converge_with_the_root_of_their_number() -> None:
    assert order_on_edges("random").is_within(-1 / 2)


@pytest.mark.parametrize(("pattern", "bound"), [("stratified", -0.9), ("sobol", -1.0)])
def test_well_spread_points_of_a_smooth_light_converge_faster(pattern: str, bound: float) -> None:
    """In theory with the power -1 and, for scrambled nets, nearly -3/2 (Owen 1997)."""
    assert order_on_lights(pattern).is_steeper(bound)


@pytest.mark.parametrize("pattern", ["stratified", "sobol"])
def test_well_spread_samples_of_an_edge_converge_faster_than_independent_ones(pattern: str) -> None:
    """With the power -3/4: of n strata the root of n hit the edge."""
    assert order_on_edges(pattern).is_steeper(-0.6)


def test_a_coarse_reference_gives_the_same_error_as_a_fine_one() -> None:
    """Half of the coarse one has an eighth of the samples of the picture, and errs more than it."""
    image = picture(EDGES, "sobol", 32, "sobol", 1, 1)
    fine, coarse = edge_reference(), edge_reference(4)
    rough, known = coarse.judge(image), fine.judge(image)
    band = ONE_IN_A_MILLION * math.hypot(rough.by_reference, known.by_reference)
    assert coarse.own_mse > known.mse
    assert abs(rough.mse - known.mse) <= band
    # With the coarse reference's own error it would be outside.
    assert coarse.own_mse > band


@pytest.mark.parametrize("count", [4, 16])
def test_the_error_of_independent_samples_is_their_variance(count: int) -> None:
    """A pixel with the share p of an edge has the variance p (1 - p) of its contrast, over the number."""
    reference = edge_reference()
    inside, outside = np.array([0.16, 0.14, 0.12]), 0.9
    share = ((outside - reference.mean) / (outside - inside)).mean(axis=2)
    expected = float(np.mean(share * (1 - share)) * np.mean((outside - inside) ** 2)) / count
    judged = [reference.judge(picture(EDGES, "random", count, "sobol", 1, seed)) for seed in range(1, 17)]
    deviation = math.sqrt(sum(one.by_pixels**2 for one in judged)) / len(judged)
    assert deviation < 0.1 * expected
    assert abs(np.mean([one.mse for one in judged]) - expected) <= ONE_IN_A_MILLION * deviation
