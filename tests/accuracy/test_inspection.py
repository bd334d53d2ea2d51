"""Inspection of a pixel: its hit, the share of each light, and the reason why it is dark."""

import json
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest

import renderer
import scenes
from accuracy.inspection import inspect, inspection_plan
from renderer.assets import FolderAssets
from renderer.math.numerics import gamma
from schemas.api.inspections import InspectedLight, InspectedRay, InspectedSurface, Inspection
from tests.documents import Json, bulb, lamp, phong, rectangle, sampled, scene, sphere, spot, sun

GALLERY = Path(scenes.__file__).parent / "gallery"
FLOOR = rectangle([-4, 0, 4], [8, 0, 0], [0, 0, -8], name="floor")
LID = rectangle([1, 2, 0.5], [1, 0, 0], [0, 0, -1], name="lid")
"""Between the origin and a light at (3, 4, 0)."""
MATT = {"plain": phong([0.5, 0.25, 1.0], ambient=0.1, diffuse=0.8)}


def down(*shapes: Json, **changes: object) -> Json:
    """A camera 10 above the origin, of which the middle one of 3 x 3 pixels looks straight down."""
    view = {"position": [0, 10, 0], "look_at": [0, 0, 0], "up": [0, 0, -1], "vertical_fov": 20}
    dark = {"ambient": [0, 0, 0], "sampling": sampled(1, 16), "materials": MATT}
    return scene(*shapes, camera={**view, "width": 3, "height": 3}, **(dark | changes))


def middle(document: Json) -> Inspection:
    return inspect(inspection_plan(document), 1, 1)


def codes(found: Inspection) -> list[str]:
    return [reason.code for reason in found.reasons]


def surface_of(found: Inspection) -> InspectedSurface:
    assert found.ray.surface is not None
    return found.ray.surface


def light_of(found: Inspection) -> InspectedLight:
    (light,) = surface_of(found).lights
    return light


def legs(ray: InspectedRay) -> Iterator[InspectedRay]:
    yield ray
    for following in ray.rays:
        yield from legs(following)


def test_surface_and_light_are_those_of_the_formula() -> None:
    """A 3-4-5 triangle: n . l = 4 / 5, reckoned in float32."""
    found = middle(down(FLOOR, lights=[bulb([3, 4, 0], [1, 0.5, 1])], ambient=[1, 1, 1]))
    surface, light = surface_of(found), light_of(found)
    assert (surface.shape, surface.part.pointer, surface.part.name) == (0, "/shapes/0", "floor")
    assert (surface.material.pointer, surface.texture) == ("/materials/plain", None)
    assert surface.color == (0.5, 0.25, 1.0)
    # Edges of 8 units and a camera at 10: a few roundings of numbers of that size.
    np.testing.assert_allclose(surface.position, [0, 0, 0], atol=16 * gamma(8))
    np.testing.assert_allclose([surface.t, *surface.uv], [10, 0.5, 0.5], rtol=gamma(16))
    assert surface.normal == surface.shading_normal == (0.0, 1.0, 0.0)
    assert (light.visibility, light.points, light.blocked, light.blockers) == (1.0, 1, 0, ())
    expected = 0.8 * np.array([0.5, 0.25, 1.0]) * 0.8 * np.array([1, 0.5, 1])
    np.testing.assert_allclose(light.diffuse, expected, rtol=8 * np.finfo(np.float32).eps)
    assert light.specular == (0.0, 0.0, 0.0)
    np.testing.assert_allclose(surface.ambient, [0.05, 0.025, 0.1], rtol=gamma(4))
    np.testing.assert_allclose(light.cosine, 0.8, rtol=gamma(16))
    assert codes(found) == ["lit"]


def test_shape_before_the_only_light_is_named() -> None:
    found = middle(down(FLOOR, LID, lights=[bulb([3, 4, 0])]))
    light = light_of(found)
    assert (light.visibility, light.blocked) == (0.0, 1)
    assert [(one.pointer, one.name, one.points) for one in light.blockers] == [("/shapes/1", "lid", 1)]
    assert light.diffuse == found.color == (0.0, 0.0, 0.0)
    assert codes(found) == ["blocked", "no_ambient"]
    assert found.reasons[0].pointers == ("/lights/0", "/shapes/1")
    assert found.reasons[0].text == "This point is unlit: shape 1 `lid` blocks light 0 (point)."
    np.testing.assert_allclose(light.unblocked, [0.16, 0.096, 0.448], rtol=8 * np.finfo(np.float32).eps)


@pytest.mark.parametrize(("key", "first"), [(1.0, "blocked"), (0.4, "lit")])
def test_shadow_of_the_stronger_light_comes_first(key: float, first: str) -> None:
    """A blocked light of cosine 0.8 leads where it would add more than a visible white one of cosine 0.5."""
    key_light = lamp([2.9, 3.9, 0.1], [0.2, 0, 0], [0, 0, -0.2], [key] * 3)
    found = middle(down(FLOOR, LID | {"name": None}, lights=[sun([-(3**0.5), -1, 0], [1, 1, 1]), key_light]))
    blocked = "Shape 1 (rectangle) blocks all 16 points of light 1 (rectangle)."
    assert codes(found)[0] == first
    assert blocked in [reason.text for reason in found.reasons]
    assert sum(found.color) > 0


def test_first_blocker_is_counted_for_each_light_point() -> None:
    """Seen from the origin, places of the light with x > 0 lie behind what spans x > 0 halfway up."""
    half, over = (rectangle([0, y, 2], [2, 0, 0], [0, 0, -4], name=f"at {y}") for y in (2, 3))
    document = down(FLOOR, over, half, lights=[lamp([-1, 4, 1], [2, 0, 0], [0, 0, -2], visible=False)])
    document["camera"] |= {"position": [0, 3, 10], "up": [0, 1, 0]}
    found = middle(document)
    seen = light_of(found)
    assert (seen.points, seen.blocked, seen.below_horizon, seen.visibility) == (16, 8, 0, 0.5)
    assert [(one.name, one.points) for one in seen.blockers] == [("at 2", 8)]
    assert codes(found)[0] == "partly_lit"


def test_light_points_below_the_horizon_are_not_seen() -> None:
    """An upright lamp beside the place, half of it below the floor's plane."""
    light = light_of(middle(down(FLOOR, lights=[lamp([3, -1, 1], [0, 2, 0], [0, 0, -2], visible=False)])))
    assert (light.visibility, light.points, light.below_horizon, light.blocked) == (0.5, 16, 8, 0)


def test_blocker_is_not_the_shape_itself_and_may_be_far() -> None:
    """The top of the ball, (0, 1, 0), and a light at (3, 5, 0) have the point (1.5, 3, 0) between them."""
    over = rectangle([1, 3, 0.5], [1, 0, 0], [0, 0, -1], name="over")
    found = middle(down(sphere([0, 0, 0], 1), over, lights=[bulb([3, 5, 0])]))
    assert [one.name for one in light_of(found).blockers] == ["over"]
    far = rectangle([-2, 1e6, 2], [4, 0, 0], [0, 0, -4])
    found = middle(down(FLOOR, far, lights=[sun([0, -1, 0])]))
    assert (found.reasons[0].code, found.reasons[0].pointers) == ("blocked", ("/lights/0", "/shapes/1"))


LIT = {"ambient": [1, 1, 1]}
BELOW = lamp([-1, -3, 1], [2, 0, 0], [0, 0, -2])
TURNED = lamp([2, 4, 1], [2, 0, 0], [0, 0, -2], two_sided=False, visible=False)
"""Its edges span a normal that points up, away from the floor."""
ASIDE = spot([3, 4, 0], [0, -1, 0], outer_angle=36.86)
"""The floor at the origin is 36.87 degrees from its middle."""
DARK = {"dark": {"type": "checker", "even": [0, 0, 0], "odd": [0, 0, 0]}}
FRONT = lamp([-1, 3, 1], [2, 0, 0], [0, 0, -2], [0.9, 0.8, 0.7])


@pytest.mark.parametrize(
    ("document", "expected"),
    [
        (down(FLOOR, lights=[bulb([3, -4, 0])], **LIT), ["faces_away", "ambient_only"]),
        (down(FLOOR, lights=[BELOW], **LIT), ["faces_away", "ambient_only"]),
        (down(FLOOR, lights=[TURNED], **LIT), ["light_turned_away", "ambient_only"]),
        (down(FLOOR, lights=[ASIDE], **LIT), ["light_turned_away", "ambient_only"]),
        (down(FLOOR, lights=[bulb([3, 4, 0], [0, 0, 0])], **LIT), ["black_light", "ambient_only"]),
        (
            down(FLOOR, lights=[bulb([3e3, 4e3, 0]) | {"falloff": "physical"}], **LIT),
            ["unanswered", "ambient_only"],
        ),
        (
            down(FLOOR, lights=[bulb([3, 4, 0])], materials={"plain": phong([0, 0, 0])}),
            ["black_material", "unanswered", "no_ambient"],
        ),
        (
            down(
                FLOOR,
                lights=[bulb([3, 4, 0])],
                materials={"plain": phong(color_texture="dark")},
                textures=DARK,
            ),
            ["black_texture", "unanswered", "no_ambient"],
        ),
        (down(FLOOR), ["no_lights", "no_ambient"]),
        (down(), ["background"]),
        (down(lights=[FRONT]), ["light_seen"]),
    ],
    ids=[
        "below",
        "lamp below",
        "turned away",
        "outside the cone",
        "black",
        "far away",
        "black material",
        "black texture",
        "no lights",
        "background",
        "lamp",
    ],
)
def test_reason_is_given_for_what_is_seen(document: Json, expected: list[str]) -> None:
    found = middle(document)
    assert codes(found) == expected
    if "ambient_only" in expected:
        # The far light is 5000 away: it adds some 1e-7 of the ambient light.
        np.testing.assert_allclose(found.color, [0.05, 0.025, 0.1], rtol=1e-6)
    if expected == ["light_seen"]:
        assert found.ray.light is not None
        assert (found.color, found.ray.light.pointer) == ((0.9, 0.8, 0.7), "/lights/0")


def test_mirror_sends_on_a_ray_at_the_same_angle() -> None:
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
    """Straight on, ((1.5 - 1) / (1.5 + 1))^2 of the light is reflected."""
    glass = {"plain": phong([0, 0, 0], ambient=0, diffuse=0, transmission=1, ior=1.5, max_depth=2)}
    found = middle(down(sphere([0, 0, 0], 1), background=[1, 1, 1], materials=glass))
    outside, inside = found.ray.rays
    assert (outside.kind, inside.kind, outside.surface) == ("reflection", "refraction", None)
    np.testing.assert_allclose([outside.weight, inside.weight], [0.04, 0.96], rtol=gamma(64))
    assert inside.surface is not None
    np.testing.assert_allclose(inside.surface.t, 2, rtol=gamma(32))
    assert [ray.kind for ray in inside.rays] == ["reflection", "refraction"]
    np.testing.assert_allclose([ray.weight for ray in inside.rays], [0.96 * 0.04, 0.96**2], rtol=gamma(64))


@pytest.mark.parametrize("path", sorted(GALLERY.glob("*.json")), ids=lambda path: path.stem)
def test_terms_add_up_to_the_pixel(path: Path) -> None:
    document = json.loads(path.read_text(encoding="utf-8"))
    document["camera"] |= {"width": 9, "height": 6}
    plan = inspection_plan(renderer.load_scene(document, assets=FolderAssets(GALLERY)))
    image = renderer.render(plan, workers=1).image
    for x, y in ((4, 3), (2, 4), (5, 1)):
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


def test_ray_of_a_lens_passes_its_middle() -> None:
    document = down(FLOOR, lights=[bulb([3, 4, 0])])
    through = document | {"camera": document["camera"] | {"lens_radius": 0.5}}
    assert inspect(inspection_plan(through), 0, 2) == inspect(inspection_plan(document), 0, 2)


@pytest.mark.slow
def test_tree_of_thousands_of_rays_is_reported_in_part() -> None:
    """Each of six walls splits a ray in two: 2^12 paths, if none leaves the glass."""
    glass = {"plain": phong([0, 0, 0], ambient=0, diffuse=0, transmission=1, ior=4, max_depth=12)}
    found = middle(down(*(sphere([0, 0, 0], radius) for radius in (1, 2, 3)), materials=glass))
    assert not found.complete
    assert len(list(legs(found.ray))) == 256


@pytest.mark.parametrize(("x", "y"), [(3, 0), (0, 3), (-1, 0)])
def test_pixel_outside_the_picture_is_refused(x: int, y: int) -> None:
    with pytest.raises(IndexError, match="3 x 3"):
        inspect(inspection_plan(down(FLOOR)), x, y)


def test_reasons_come_in_the_order_of_what_they_add() -> None:
    lights = [bulb([3, 4, 0], [0.1, 0.1, 0.1]), bulb([-3, 4, 0], [1, 1, 1])]
    found = middle(down(FLOOR, lights=lights))
    assert [reason.pointers[0] for reason in found.reasons] == ["/lights/1", "/lights/0"]
    # Through glass whose highlight is (r . v)^70: nothing, but not zero.
    shiny = {"specular": 1, "shininess": 70, "transmission": 1, "ior": 1.5, "max_depth": 4}
    materials = MATT | {"glass": phong([0, 0, 0], ambient=0, diffuse=0, **shiny)}
    ball = sphere([0, 2, 0], 1, material="glass")
    light = bulb([3, 6, 0], [1, 1, 1])
    found = middle(down(ball, FLOOR, lights=[light], materials=materials, background=[0] * 3, **LIT))
    assert 0 < max(light_of(found).specular) < 1e-10
    assert codes(found)[0] == "refraction"
    assert "lit" not in codes(found)
