"""The scenes of the benchmark of effects differ in just what they are to measure."""

from __future__ import annotations

import pytest

import renderer
from benchmarks.effects import EFFECTS, Effect, plan_of
from renderer.tiling import tiles

WITH_ZERO = [effect for effect in EFFECTS if effect.zero is not None]


@pytest.mark.parametrize("effect", EFFECTS, ids=lambda effect: effect.name)
def test_a_scene_with_an_effect_has_a_plan_of_its_own(effect: Effect) -> None:
    assert plan_of(effect.asked).entries != plan_of(effect.without).entries


@pytest.mark.parametrize("effect", WITH_ZERO, ids=lambda effect: effect.name)
def test_an_effect_of_strength_zero_has_the_plan_and_the_pixels_of_the_scene_without_it(
    effect: Effect,
) -> None:
    assert effect.zero is not None
    zero, without = plan_of(effect.zero), plan_of(effect.without)
    assert zero.entries == without.entries
    (coarse,) = tiles(zero, zero.passes[0])
    seen, expected = (renderer.render_tile(plan, coarse, plan.passes[0]) for plan in (zero, without))
    assert seen.pixels.tobytes() == expected.pixels.tobytes()
    assert (seen.counts, seen.work) == (expected.counts, expected.work)
