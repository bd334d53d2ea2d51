"""Warnings are given for what is pointless, and only then."""

import math
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from schemas.cameras import Camera
from schemas.reading import read_scene
from schemas.reading.advice import in_view, no_area
from schemas.scene import Scene
from schemas.shapes import Triangle


def warnings(scene: dict[str, Any]) -> list[tuple[str, str]]:
    return [(warning.pointer, warning.code) for warning in read_scene(scene)[1]]


def test_no_light(scene: dict[str, Any]) -> None:
    scene["lights"] = []
    assert warnings(scene) == [("/lights", "no_light")]
    del scene["ambient"]
    assert warnings(scene) == [("/lights", "black_picture")]


def test_unused_names(scene: dict[str, Any]) -> None:
    scene["materials"]["spare/part"] = {"type": "phong", "color": [1, 1, 1]}
    scene["textures"]["spare"] = {"type": "checker"}
    assert warnings(scene) == [("/materials/spare~1part", "unused"), ("/textures/spare", "unused")]


@pytest.mark.parametrize("up", [[0, -1, -8], [0, 3, 24], [0, 1e-9, 8e-9]])
def test_up_along_the_view(scene: dict[str, Any], up: list[float]) -> None:
    scene["camera"]["up"] = up
    assert warnings(scene) == [("/camera/up", "up_parallel_to_view")]


@pytest.mark.parametrize(("angle", "warned"), [(1e-9, False), (1e-10, True), (1e-300, True)])
def test_narrow_view(scene: dict[str, Any], angle: float, warned: bool) -> None:
    """512 rows of 2**-45 are 8.3e-10 degrees."""
    scene["camera"] |= {"vertical_fov": angle, "height": 512}
    assert warnings(scene) == [("/camera/vertical_fov", "narrow_view")] * warned


def test_nothing_in_view(scene: dict[str, Any]) -> None:
    scene["camera"]["look_at"] = [0, 2, 20]
    assert warnings(scene) == [("/camera", "nothing_in_view")]


BARE = {
    "triangle": {"type": "triangle", "vertices": [[0, 0, 0], [1, 0, 0], [0, 1, 0]]},
    "mesh": {"type": "mesh", "vertices": [[0, 0, 0], [1, 0, 0], [0, 1, 0]], "triangles": [[0, 1, 2]]},
}


@pytest.mark.parametrize("kind", BARE)
@pytest.mark.parametrize("part", ["color_texture", "normal_map", "bump_map", "displacement_map"])
def test_missing_texture_coordinates(scene: dict[str, Any], kind: str, part: str) -> None:
    """Once a material, at its first such shape, with how many more there are."""
    scene["textures"]["image"] = {"type": "image", "asset": "a.png"}
    heights = {"bump_height": 0.1, "displacement_height": 0.1}
    textured = {"type": "phong", part: "image"} | ({} if part == "color_texture" else {"color": [1, 1, 1]})
    scene["materials"]["textured"] = textured | heights
    bare = BARE[kind] | {"material": "textured"}
    first = len(scene["shapes"])
    scene["shapes"] += [bare | {"uvs": [[0, 0], [1, 0], [0, 1]]}, bare, bare, bare]
    (warning,) = read_scene(scene)[1]
    assert (warning.pointer, warning.code) == (f"/shapes/{first + 1}", "no_texture_coordinates")
    assert part in warning.detail
    assert "2 other shapes" in warning.detail
    scene["shapes"][first + 1 :] = [bare | {"material": "plain"}]
    assert warnings(scene) == []


FLAT_MESHES = {
    "on one line": [[0, 1, 2], [2, 1, 0]],
    "twice the same vertex": [[0, 0, 3], [1, 3, 3]],
    "a point": [[2, 2, 2]],
}


@pytest.mark.parametrize("name", FLAT_MESHES)
def test_mesh_without_area(scene: dict[str, Any], name: str) -> None:
    mesh = {"type": "mesh", "vertices": [[0, 0, 0], [1, 1, 1], [3, 3, 3], [0, 1, 0]], "material": "plain"}
    flat = mesh | {"triangles": FLAT_MESHES[name]}
    scene["shapes"].append(flat)
    last = len(scene["shapes"]) - 1
    assert warnings(scene) == [(f"/shapes/{last}/triangles", "no_area")]
    flat["triangles"] = [*FLAT_MESHES[name], [0, 1, 3]]
    assert warnings(scene) == []


def test_flat_ellipsoid(scene: dict[str, Any]) -> None:
    scene["shapes"][3]["axes"] = [[1, 0, 0], [0, 1, 0], [0, 0, 0.99e-8]]
    assert warnings(scene) == [("/shapes/3/axes", "very_flat")]
    scene["shapes"][3]["axes"][2][2] = 1e-8
    assert warnings(scene) == []


@pytest.mark.parametrize("height", [0.5, 1.0, 2.9])
def test_light_inside_an_ellipsoid(scene: dict[str, Any], height: float) -> None:
    scene["lights"] = [{"type": "point", "position": [0, height, 0], "color": [1, 1, 1]}]
    scene["shapes"][4]["radius"] = 0.1
    scene["shapes"][4]["center"] = [2, 0, 0]
    assert warnings(scene) == [("/lights/0", "light_inside")]


def test_light_that_touches_an_ellipsoid(scene: dict[str, Any]) -> None:
    scene["lights"] = [
        {"type": "rectangle", "corner": [0, 1.5, 0], "edges": [[9, 0, 0], [0, 0, 1]], "color": [1, 1, 1]}
    ]
    assert warnings(scene) == []


@given(
    a=st.tuples(*[st.integers(-(1 << 20), 1 << 20)] * 3),
    direction=st.tuples(*[st.integers(-1000, 1000)] * 3),
    steps=st.tuples(st.integers(-1000, 1000), st.integers(-1000, 1000)),
    power=st.integers(-60, 20),
)
def test_triangle_without_area_at_any_scale(
    a: tuple[int, ...], direction: tuple[int, ...], steps: tuple[int, int], power: int
) -> None:
    vertices = [
        [math.ldexp(p + step * d, power) for p, d in zip(a, direction, strict=True)] for step in (0, *steps)
    ]
    assert no_area(Triangle.model_validate({"type": "triangle", "vertices": vertices, "material": "m"}))


@given(column=st.floats(0, 64), row=st.floats(0, 48), distance=st.floats(1e-3, 1e6), angle=st.floats(1, 179))
def test_ball_on_any_camera_ray_is_in_view(column: float, row: float, distance: float, angle: float) -> None:
    h = math.tan(math.radians(angle) / 2)
    x, y = h * 64 / 48 * (2 * column / 64 - 1), h * (1 - 2 * row / 48)
    camera = Camera(
        position=(0, 0, 0), look_at=(0, 0, -1), vertical_fov=angle, width=64, height=48, up=(0, 1, 0)
    )
    ball = {
        "type": "ellipsoid",
        "center": [x * distance, y * distance, -distance],
        "radius": 1e-6,
        "material": "m",
    }
    materials = {"m": {"type": "phong", "color": [1, 1, 1]}}
    scene = {"version": 1, "camera": camera, "shapes": [ball], "materials": materials}
    assert in_view(Scene.model_validate(scene))


def test_colour_in_steps_of_255(scene: dict[str, Any]) -> None:
    scene["materials"]["plain"]["color"] = [1, 1, 1]
    assert read_scene(scene)[1] == ()
    scene["materials"]["plain"]["color"] = [255, 128, 0]
    (warning,) = read_scene(scene)[1]
    assert (warning.pointer, warning.code) == ("/materials/plain/color", "bright_color")


def _huge(half: float) -> list[dict[str, Any]]:
    """Floors of a half side, and a ball of that radius that the camera stands on."""
    corners = [[-half, 0, -half], [half, 0, -half], [half, 0, half]]
    flat = {"type": "rectangle", "corner": corners[0], "edges": [[0, 0, 2 * half], [2 * half, 0, 0]]}
    unit = {"type": "mesh", "vertices": [[-1, 0, -1], [1, 0, -1], [1, 0, 1]], "triangles": [[0, 1, 2]]}
    return [
        flat,
        {"type": "triangle", "vertices": corners},
        {**unit, "scale": half},
        {"type": "ellipsoid", "center": [0, -half, 0], "radius": half},
    ]


@pytest.mark.parametrize("number", range(4))
def test_shape_that_rounding_shows_on(scene: dict[str, Any], number: int) -> None:
    """At 1e9 doubles are 1e-7 apart, at 1e13 0.002: a tenth of a pixel."""
    count = len(scene["shapes"])
    for half, warned in ((1e9, False), (1e13, True)):
        shapes = [*scene["shapes"], {**_huge(half)[number], "material": "plain"}]
        expected = [(f"/shapes/{count}", "very_large")] * warned
        assert warnings({**scene, "shapes": shapes}) == expected


def test_warnings_are_cut_at_50(scene: dict[str, Any]) -> None:
    scene["shapes"] += [{"type": "triangle", "vertices": [[0, 0, 0]] * 3, "material": "plain"}] * 70
    assert len(warnings(scene)) == 50
