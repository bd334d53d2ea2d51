"""What a pixel's ray hits, what each light adds there, and why it is dark."""

import json
import math
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import renderer
import scenes
from accuracy.hard_cases.documents import Json, bulb, lamp, phong, rectangle, sampled, scene, sphere, sun
from accuracy.inspection import inspect, inspection_plan
from accuracy.inspection.paths import MOST_RAYS
from accuracy.inspection.pixels import POINTS
from renderer.assets import FolderAssets
from renderer.math.numerics import gamma
from schemas.api.inspections import InspectedRay, Inspection
from schemas.quality import Antialiasing, FixedQuality, LightSampling, TargetQuality

GALLERY = Path(scenes.__file__).parent / "gallery"
FLOOR = rectangle([-4, 0, 4], [8, 0, 0], [0, 0, -8], name="floor")
LID = rectangle([1, 2, 0.5], [1, 0, 0], [0, 0, -1], name="lid")
"""Between the origin and a light at (3, 4, 0)."""


def down(*shapes: Json, **changes: Any) -> Json:
    """A camera 10 above the origin, of which the middle one of 3 x 3 pixels looks straight down."""
    camera = {
        "position": [0, 10, 0],
        "look_at": [0, 0, 0],
        "up": [0, 0, -1],
        "vertical_fov": 20,
        "width": 3,
        "height": 3,
    }
    dark = {"ambient": [0, 0, 0], "sampling": sampled(1, 16)}
    return scene(*shapes, camera=camera, **(dark | changes))


def middle(document: Json) -> Inspection:
    return inspect(inspection_plan(document), 1, 1)


def codes(found: Inspection) -> list[str]:
    return [reason.code for reason in found.reasons]


def legs(ray: InspectedRay) -> Iterator[InspectedRay]:
    yield ray
    for following in ray.rays:
        yield from legs(following)


MATT = {"plain": phong([0.5, 0.25, 1.0], ambient=0.1, diffuse=0.8)}


def test_the_place_is_where_the_ray_hits_the_shape() -> None:
    found = middle(down(FLOOR, lights=[bulb([3, 4, 0], [1, 1, 1])], materials=MATT))
    surface = found.ray.surface
    assert surface is not None
    assert (surface.shape, surface.part.pointer, surface.part.name) == (0, "/shapes/0", "floor")
    assert surface.material.pointer == "/materials/plain"
    assert surface.texture is None
    assert surface.color == (0.5, 0.25, 1.0)
    # Edges of 8 units and a camera at 10: a few roundings of numbers of that size.
    np.testing.assert_allclose(surface.position, [0, 0, 0], atol=16 * gamma(8))
    np.testing.assert_allclose([surface.t, *surface.uv], [10, 0.5, 0.5], rtol=gamma(16))
    assert surface.normal == surface.shading_normal == (0.0, 1.0, 0.0)


def test_a_light_in_view_adds_what_the_formula_says() -> None:
    found = middle(down(FLOOR, lights=[bulb([3, 4, 0], [1, 0.5, 1])], ambient=[1, 1, 1], materials=MATT))
    assert found.ray.surface is not None
    (light,) = found.ray.surface.lights
    assert (light.visibility, light.points, light.blocked, light.blockers) == (1.0, 1, 0, ())
    # A 3-4-5 triangle: n . l = 4 / 5, reckoned in float32.
    expected = 0.8 * np.array([0.5, 0.25, 1.0]) * 0.8 * np.array([1, 0.5, 1])
    np.testing.assert_allclose(light.diffuse, expected, rtol=8 * np.finfo(np.float32).eps)
    assert light.specular == (0.0, 0.0, 0.0)
    np.testing.assert_allclose(found.ray.surface.ambient, [0.05, 0.025, 0.1], rtol=gamma(4))
    np.testing.assert_allclose(light.cosine, 0.8, rtol=gamma(16))
    assert codes(found) == ["lit"]
    assert "37 degrees" in found.reasons[0].text
    assert "80%" in found.reasons[0].text


def test_a_shape_before_the_only_light_is_named() -> None:
    found = middle(down(FLOOR, LID, lights=[bulb([3, 4, 0])], materials=MATT))
    assert found.ray.surface is not None
    (light,) = found.ray.surface.lights
    assert (light.visibility, light.blocked) == (0.0, 1)
    assert [(one.pointer, one.name, one.points) for one in light.blockers] == [("/shapes/1", "lid", 1)]
    assert light.diffuse == found.color == (0.0, 0.0, 0.0)
    assert codes(found) == ["blocked", "no_ambient"]
    assert "shape 1 `lid`" in found.reasons[0].text
    assert found.reasons[0].pointers == ("/lights/0", "/shapes/1")


def test_what_is_first_in_the_way_is_counted_for_each_point_of_the_light() -> None:
    # Seen from the origin, places of the light with x > 0 lie behind what spans x > 0 halfway up.
    half = rectangle([0, 2, 2], [2, 0, 0], [0, 0, -4], name="half")
    over = rectangle([0, 3, 2], [2, 0, 0], [0, 0, -4], name="over")
    light = lamp([-1, 4, 1], [2, 0, 0], [0, 0, -2], visible=False)
    document = down(FLOOR, over, half, lights=[light], materials=MATT)
    document["camera"] |= {"position": [0, 3, 10], "up": [0, 1, 0]}
    found = middle(document)
    assert found.ray.surface is not None
    (seen,) = found.ray.surface.lights
    assert (seen.points, seen.blocked, seen.below_horizon, seen.visibility) == (16, 8, 0, 0.5)
    assert [(one.name, one.points) for one in seen.blockers] == [("half", 8)]
    assert codes(found)[0] == "partly_lit"
    assert "8 of 16 points; shape 2 `half` hides 8" in found.reasons[0].text


def test_a_round_shape_does_not_stand_before_itself() -> None:
    # The top of the ball, (0, 1, 0), and a light at (3, 5, 0) have the point (1.5, 3, 0) between them.
    over = rectangle([1, 3, 0.5], [1, 0, 0], [0, 0, -1], name="over")
    found = middle(down(sphere([0, 0, 0], 1), over, lights=[bulb([3, 5, 0])], materials=MATT))
    assert found.ray.surface is not None
    assert [one.name for one in found.ray.surface.lights[0].blockers] == ["over"]


def test_a_sun_is_blocked_by_what_lies_at_any_distance() -> None:
    far = rectangle([-2, 1e6, 2], [4, 0, 0], [0, 0, -4], name="far")
    found = middle(down(FLOOR, far, lights=[sun([0, -1, 0])], materials=MATT))
    assert found.reasons[0].code == "blocked"
    assert found.reasons[0].pointers == ("/lights/0", "/shapes/1")


@pytest.mark.parametrize(
    ("light", "code"),
    [
        (bulb([3, -4, 0]), "faces_away"),
        (lamp([-1, -3, 1], [2, 0, 0], [0, 0, -2]), "faces_away"),
        # Its edges span a normal that points up, away from the floor.
        (lamp([2, 4, 1], [2, 0, 0], [0, 0, -2], two_sided=False, visible=False), "light_turned_away"),
        (bulb([3, 4, 0], [0, 0, 0]), "black_light"),
    ],
)
def test_a_light_that_gives_nothing_comes_with_its_reason(light: Json, code: str) -> None:
    found = middle(down(FLOOR, lights=[light], ambient=[1, 1, 1], materials=MATT))
    assert codes(found) == [code, "ambient_only"]
    np.testing.assert_allclose(found.color, [0.05, 0.025, 0.1], rtol=gamma(4))


def test_a_black_material_comes_first() -> None:
    found = middle(down(FLOOR, lights=[bulb([3, 4, 0])], materials={"plain": phong([0, 0, 0])}))
    assert codes(found) == ["black_material", "unanswered", "no_ambient"]


def test_a_scene_without_lights_has_that_as_its_reason() -> None:
    assert codes(middle(down(FLOOR, materials=MATT))) == ["no_lights", "no_ambient"]


def test_where_there_is_no_shape_the_background_or_a_light_is_seen() -> None:
    found = middle(down(background=[0.1, 0.2, 0.3]))
    assert (found.color, found.reasons[0].code) == ((0.1, 0.2, 0.3), "background")
    assert found.ray.surface is None
    shown = middle(down(lights=[lamp([-1, 3, 1], [2, 0, 0], [0, 0, -2], [0.9, 0.8, 0.7])]))
    assert (shown.color, shown.reasons[0].code) == ((0.9, 0.8, 0.7), "light_seen")
    assert shown.ray.light is not None
    assert shown.ray.light.pointer == "/lights/0"


def test_a_mirror_sends_on_a_ray_at_the_same_angle() -> None:
    mirror = {"plain": phong([0, 0, 0], ambient=0, diffuse=0, mirror=0.5)}
    document = down(FLOOR, background=[0.2, 0.4, 0.6], materials=mirror)
    document["camera"] |= {"position": [3, 4, 0]}
    found = middle(document)
    (on,) = found.ray.rays
    assert (on.kind, on.weight, on.surface) == ("mirror", 0.5, None)
    np.testing.assert_allclose(found.ray.direction, [-0.6, -0.8, 0], atol=gamma(32))
    np.testing.assert_allclose(on.direction, [-0.6, 0.8, 0], atol=gamma(32))
    assert found.color == (0.1, 0.2, 0.3)


def test_glass_sends_on_two_rays_by_fresnel() -> None:
    glass = {"plain": phong([0, 0, 0], ambient=0, diffuse=0, transmission=1, ior=1.5, max_depth=2)}
    found = middle(down(sphere([0, 0, 0], 1), background=[1, 1, 1], materials=glass))
    # Straight on, ((1.5 - 1) / (1.5 + 1))^2 of the light is reflected.
    outside, inside = found.ray.rays
    assert (outside.kind, inside.kind) == ("reflection", "refraction")
    np.testing.assert_allclose([outside.weight, inside.weight], [0.04, 0.96], rtol=gamma(64))
    assert outside.surface is None
    assert inside.surface is not None
    np.testing.assert_allclose(inside.surface.t, 2, rtol=gamma(32))
    assert [ray.kind for ray in inside.rays] == ["reflection", "refraction"]
    np.testing.assert_allclose([ray.weight for ray in inside.rays], [0.96 * 0.04, 0.96**2], rtol=gamma(64))


@pytest.mark.parametrize("path", sorted(GALLERY.glob("*.json")), ids=lambda path: path.stem)
def test_what_is_reported_adds_up_to_the_pixel_of_one_ray(path: Path) -> None:
    document = json.loads(path.read_text(encoding="utf-8"))
    document["camera"] |= {"width": 9, "height": 6}
    plan = inspection_plan(renderer.load_scene(document, assets=FolderAssets(GALLERY)))
    image = renderer.render(plan, workers=1).image
    for x, y in ((4, 3), (2, 4), (7, 5), (5, 1)):
        found = inspect(plan, x, y)
        assert np.float32(found.color).tolist() == image[y, x].tolist()
        assert found.complete
        total, terms = np.zeros(3), 0
        for ray in legs(found.ray):
            parts = [np.array(ray.radiance)]
            if ray.surface is not None:
                lights = [term for light in ray.surface.lights for term in (light.diffuse, light.specular)]
                parts = [np.array(part) for part in (ray.surface.ambient, *lights)]
            np.testing.assert_allclose(sum(parts), ray.radiance, rtol=gamma(len(parts)))
            total += ray.weight * np.array(ray.radiance)
            terms += len(parts) + 1
        # All terms are positive: each addition in another order costs at most a rounding.
        np.testing.assert_allclose(total, found.color, rtol=gamma(2 * terms))


def test_the_ray_of_a_lens_passes_its_middle() -> None:
    document = down(FLOOR, lights=[bulb([3, 4, 0])], materials=MATT)
    through = document | {"camera": document["camera"] | {"lens_radius": 0.5}}
    assert inspect(inspection_plan(through), 0, 2) == inspect(inspection_plan(document), 0, 2)


def test_lights_are_sampled_as_in_the_picture_or_finely_where_it_takes_what_it_needs() -> None:
    document = down(FLOOR, lights=[lamp([-1, 4, 1], [2, 0, 0], [0, 0, -2])], materials=MATT)
    few = FixedQuality(
        mode="fixed",
        antialiasing=Antialiasing(pattern="sobol", samples=8),
        light=LightSampling(pattern="sobol", samples=2),
    )
    found = [
        inspection_plan(document, quality).lightings[0].emitter.count
        for quality in (None, few, TargetQuality(mode="target", error=0.01))
    ]
    assert found == [16, 2, POINTS]


def test_a_tree_of_thousands_of_rays_is_reported_in_part() -> None:
    # Each of six walls splits a ray in two: 2^12 paths, if none leaves the glass.
    glass = {"plain": phong([0, 0, 0], ambient=0, diffuse=0, transmission=1, ior=4, max_depth=12)}
    shells = [sphere([0, 0, 0], radius) for radius in (1, 2, 3)]
    found = middle(down(*shells, materials=glass))
    assert len(list(legs(found.ray))) == MOST_RAYS
    assert not found.complete


@pytest.mark.parametrize(("x", "y"), [(3, 0), (0, 3), (-1, 0)])
def test_a_pixel_outside_the_picture_is_refused(x: int, y: int) -> None:
    with pytest.raises(IndexError, match="3 x 3 pixels"):
        inspect(inspection_plan(down(FLOOR, materials=MATT)), x, y)


def test_the_angle_reported_is_that_of_the_light() -> None:
    found = middle(down(FLOOR, lights=[bulb([4, 4, 0])], materials=MATT))
    assert found.ray.surface is not None
    assert math.isclose(found.ray.surface.lights[0].cosine, math.sqrt(0.5), rel_tol=gamma(16))
    assert "45 degrees" in found.reasons[0].text


def test_what_adds_most_comes_first_and_what_adds_nothing_is_no_reason() -> None:
    # Seen through glass whose highlight is (r . v)^90: nothing, but not zero.
    glass = phong([0, 0, 0], ambient=0, diffuse=0, specular=1, shininess=90, transmission=1, ior=1.5)
    document = down(
        sphere([0, 2, 0], 1) | {"material": "glass"},
        rectangle([-4, 0, 4], [8, 0, 0], [0, 0, -8], name="wall"),
        lights=[bulb([3, 6, 0], [1, 1, 1])],
        materials=MATT | {"glass": glass | {"max_depth": 4}},
        ambient=[1, 1, 1],
        background=[0, 0, 0],
    )
    found = middle(document)
    assert found.ray.surface is not None
    assert 0 < max(found.ray.surface.lights[0].specular) < 1e-10
    assert codes(found)[0] == "refraction"
    assert "most of it from shape 1 `wall`" in found.reasons[0].text
    assert "lit" not in codes(found)
    assert "Nothing lights it: the material `glass` reflects next to no light from light 0." in [
        reason.text for reason in found.reasons
    ]


def test_lights_are_named_by_how_much_they_add() -> None:
    lights = [bulb([3, 4, 0], [0.1, 0.1, 0.1]), bulb([-3, 4, 0], [1, 1, 1])]
    found = middle(down(FLOOR, lights=lights, materials=MATT))
    assert [reason.pointers[0] for reason in found.reasons] == ["/lights/1", "/lights/0"]
