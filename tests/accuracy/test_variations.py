"""Variations of a scene: one effect left out at a time, and few samples."""

from __future__ import annotations

from typing import Any

import pytest

import renderer
from accuracy.variations import PLAIN, Variant, few_samples, marginal_costs
from accuracy.variations import variants as variants_of

SCENE: dict[str, Any] = {
    "version": 1,
    "camera": {"position": [0, 1, 6], "look_at": [0, 0, 0], "lens_radius": 0.2, "width": 300, "height": 200},
    "ambient": [1, 1, 1],
    "materials": {
        "shiny/ball": {"type": "phong", "color": [0.5, 0.5, 0.5], "specular": 0.5},
        "floor": {"type": "phong", "color": [0.7, 0.7, 0.7], "mirror": 0.4},
    },
    "shapes": [
        {"type": "ellipsoid", "center": [0, 0, 0], "radius": 1, "material": "shiny/ball"},
        {"type": "rectangle", "center": [0, -1, 0], "normal": [0, 1, 0], "tangent": [1, 0, 0], "size": [9, 9],
         "material": "floor"},
    ],
    "lights": [
        {"type": "point", "position": [2, 4, 3], "color": [0.6, 0.6, 0.6]},
        {"type": "directional", "direction": [1, -1, 0], "color": [0, 0, 0]},
    ],
}  # fmt: skip


@pytest.fixture(scope="module")
def variants() -> dict[str, Variant]:
    document = renderer.load_scene(SCENE).document
    return {variant.effect: variant for variant in variants_of(document)}


def test_every_effect_that_the_scene_has_is_left_out_once(variants: dict[str, Variant]) -> None:
    assert list(variants) == ["light 0", "light 1", "highlights", "mirror", "lens", "antialiasing"]


def test_pointers_name_what_requested_a_stage(variants: dict[str, Variant]) -> None:
    assert variants["highlights"].pointers == ("/materials/shiny~1ball/specular",)
    assert variants["mirror"].pointers == ("/materials/floor/mirror",)


def test_nothing_but_the_effect_is_gone(variants: dict[str, Variant]) -> None:
    for variant in variants.values():
        again = {other.effect for other in variants_of(variant.document)}
        missing = set(variants) - again
        # Lights are counted anew when one of them is gone.
        assert missing == ({"light 1"} if variant.effect.startswith("light") else {variant.effect})


def test_a_texture_is_left_out_for_a_plain_colour() -> None:
    board = {"type": "checker", "even": [1, 1, 1], "odd": [0, 0, 0], "repeat": [8, 8]}
    floor = {"type": "phong", "color_texture": "board"}
    document = SCENE | {"textures": {"board": board}, "materials": SCENE["materials"] | {"floor": floor}}
    found = {variant.effect: variant for variant in variants_of(renderer.load_scene(document).document)}
    assert found["texture"].pointers == ("/materials/floor/color_texture",)
    without = found["texture"].document.materials["floor"]
    assert (without.color_texture, without.color) == (None, PLAIN)
    whole, plain = (renderer.compile_scene(one) for one in (document, found["texture"].document))
    assert {stage.effect for stage in whole.describe().stages} > {"textures.checker"}
    assert "textures.checker" not in {stage.effect for stage in plain.describe().stages}


def test_an_effect_without_effect_makes_no_difference() -> None:
    seconds, rows = marginal_costs(renderer.load_scene(SCENE))
    by_effect = {row.effect: row for row in rows}
    assert seconds > 0
    assert by_effect["light 1"].difference == 0  # it is black
    assert min(row.difference for row in rows if row.effect != "light 1") > 0
    assert [row.seconds for row in rows] == sorted((row.seconds for row in rows), reverse=True)


@pytest.mark.parametrize("pattern", ["uniform", "rotated", "random", "stratified", "sobol", "center"])
@pytest.mark.parametrize("samples", [1, 9, 25, 64])
def test_few_samples_keep_the_patterns_of_the_scene(pattern: str, samples: int) -> None:
    antialiasing = {"pattern": pattern, "samples": 1 if pattern == "center" else samples}
    sampling = {"antialiasing": antialiasing, "light": {"pattern": "uniform", "samples": samples}}
    document = renderer.load_scene(SCENE | {"sampling": sampling}).document
    quality = few_samples(document.sampling, 16, 16)
    assert quality.antialiasing is not None
    assert quality.light is not None
    assert quality.antialiasing.pattern == pattern
    assert quality.antialiasing.samples == min(16, antialiasing["samples"])
    assert quality.light.samples == min(16, samples)
