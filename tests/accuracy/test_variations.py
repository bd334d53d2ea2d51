"""Variations of a scene: one effect left out at a time, and few samples."""

from typing import Any

import pytest

import renderer
from accuracy.variations import Variant, few_samples, marginal_costs
from accuracy.variations import variants as variants_of
from tests.documents import bulb, camera, phong, rectangle, sampled, scene, sphere, sun

SCENE: dict[str, Any] = scene(
    sphere([0, 0, 0], 1, material="shiny/ball"),
    rectangle([-4.5, -1, -4.5], [0, 0, 9], [9, 0, 0], material="floor"),
    camera=camera(position=[0, 1, 6], look_at=[0, 0, 0], lens_radius=0.2, width=90, height=60),
    materials={"shiny/ball": phong([0.5] * 3, specular=0.5), "floor": phong([0.7] * 3, mirror=0.4)},
    lights=[bulb([2, 4, 3]), sun([1, -1, 0], [0, 0, 0])],
    sampling=sampled(16, 4),
)


def variants(document: dict[str, Any] = SCENE) -> dict[str, Variant]:
    return {each.effect: each for each in variants_of(renderer.load_scene(document).document)}


def test_effects_are_left_out_one_at_a_time() -> None:
    """Lights are counted anew when one of them is gone."""
    found = variants()
    assert list(found) == ["light 0", "light 1", "highlights", "mirror", "lens", "antialiasing"]
    assert found["highlights"].pointers == ("/materials/shiny~1ball/specular",)
    assert found["mirror"].pointers == ("/materials/floor/mirror",)
    for effect, variant in found.items():
        missing = set(found) - {other.effect for other in variants_of(variant.document)}
        assert missing == ({"light 1"} if effect.startswith("light") else {effect})


def test_texture_is_left_out_for_a_plain_colour() -> None:
    board = {"type": "checker", "even": [1, 1, 1], "odd": [0, 0, 0], "repeat": [8, 8]}
    painted = SCENE["materials"] | {"floor": phong(color_texture="board")}
    document = SCENE | {"textures": {"board": board}, "materials": painted}
    found = variants(document)["texture"]
    assert found.pointers == ("/materials/floor/color_texture",)
    assert found.document.materials["floor"].color_texture is None
    whole, plain = (
        {stage.effect for stage in renderer.compile_scene(each).describe().stages}
        for each in (document, found.document)
    )
    assert whole - plain == {"textures.checker"}


def test_effect_that_changes_nothing_makes_no_difference() -> None:
    seconds, rows = marginal_costs(renderer.load_scene(SCENE))
    assert seconds > 0
    assert [row.effect for row in rows if row.difference == 0] == ["light 1"]  # it is black
    assert [row.seconds for row in rows] == sorted((row.seconds for row in rows), reverse=True)


@pytest.mark.parametrize("pattern", ["uniform", "rotated", "random", "stratified", "sobol", "center"])
@pytest.mark.parametrize("samples", [1, 9, 25])
def test_few_samples_keep_the_patterns_of_the_scene(pattern: str, samples: int) -> None:
    own = 1 if pattern == "center" else samples
    sampling = {
        "antialiasing": {"pattern": pattern, "samples": own},
        "light": {"pattern": "uniform", "samples": samples},
    }
    document = renderer.load_scene(SCENE | {"sampling": sampling}).document
    quality = few_samples(document.sampling, 16, 16)
    assert quality.antialiasing is not None
    assert quality.light is not None
    assert (quality.antialiasing.pattern, quality.antialiasing.samples) == (pattern, min(16, own))
    assert quality.light.samples == min(16, samples)
