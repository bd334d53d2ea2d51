"""Prices without a pilot."""

from __future__ import annotations

import pytest

import renderer
from accuracy.quotes.prices import price
from renderer.scenes import LoadedScene
from schemas.quality import Antialiasing, FixedQuality, TargetQuality


def cost_at(scene: LoadedScene, error: float, *, limit: float | None = None, workers: int = 1) -> float:
    quality = TargetQuality(mode="target", error=error, time_limit=limit)
    return price(renderer.compile_scene(scene, quality), workers).cpu_seconds


def test_fixed_samples_cost_what_their_plan_says(ball_scene: LoadedScene) -> None:
    quality = FixedQuality(mode="fixed", antialiasing=Antialiasing(pattern="random", samples=5))
    plan = renderer.compile_scene(ball_scene, quality)
    assert price(plan, 7) == plan.describe().cost


def test_a_step_of_8_bits_costs_as_much_as_four_samples(ball_scene: LoadedScene) -> None:
    plan = renderer.compile_scene(ball_scene, TargetQuality(mode="target", error=1 / 255))
    assert price(plan, 1).camera_rays == 4 * 48 * 40
    assert cost_at(ball_scene, 0.5 / 255) == pytest.approx(2 * cost_at(ball_scene, 1 / 255))


def test_every_pixel_is_sampled_however_large_the_error_is(ball_scene: LoadedScene) -> None:
    assert cost_at(ball_scene, 1.0) == cost_at(ball_scene, 0.5) > 0


def test_a_time_limit_bounds_the_price_by_what_all_workers_do_in_it(ball_scene: LoadedScene) -> None:
    free = cost_at(ball_scene, 1e-5)
    assert cost_at(ball_scene, 1e-5, limit=free / 4, workers=2) == pytest.approx(free / 2)
    assert cost_at(ball_scene, 1e-5, limit=free, workers=2) == free
