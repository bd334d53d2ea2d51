"""Accepted and refused values of the scene language, field by field."""

import copy
import json
import math
from typing import Any

import pytest

from schemas.errors import SceneError
from schemas.limits import Limits
from schemas.quality import Antialiasing
from schemas.reading import read_scene


def changed(scene: dict[str, Any], pointer: str, value: object) -> dict[str, Any]:
    """A copy with one place set; a value of `...` removes it."""
    scene = copy.deepcopy(scene)
    *path, last = pointer.split("/")[1:]
    node: Any = scene
    for part in path:
        node = node[int(part) if isinstance(node, list) else part]
    if value is ...:
        del node[last]
    else:
        node[int(last) if isinstance(node, list) else last] = value
    return scene


def problems(scene: object) -> dict[str, str]:
    with pytest.raises(SceneError) as caught:
        read_scene(json.dumps(scene))
    assert caught.value.more == 0
    return {problem.pointer: problem.code for problem in caught.value.errors}


def test_scene_with_everything(scene: dict[str, Any]) -> None:
    read, warnings = read_scene(json.dumps(scene).encode())
    assert warnings == ()
    assert [type(shape).__name__ for shape in read.shapes] == [
        "Triangle",
        "Rectangle",
        "Parallelogram",
        "Ellipsoid",
        "Sphere",
    ]
    assert [type(light).__name__ for light in read.lights] == [
        "RectangleLight",
        "ParallelogramLight",
        "PointLight",
        "SpotLight",
        "DirectionalLight",
    ]


def test_scene_is_written_and_read_again(scene: dict[str, Any]) -> None:
    read, _ = read_scene(scene)
    assert read_scene(read.model_dump_json())[0] == read


@pytest.mark.parametrize("version", [True, "1", 2, 0, None, [1]])
def test_version(scene: dict[str, Any], version: object) -> None:
    assert list(problems(changed(scene, "/version", version))) == ["/version"]


@pytest.mark.parametrize(
    "wrong",
    ["1", True, None, [], {}, math.nan, math.inf, -math.inf, 1.0001e15, -1.0001e15, 10**400],
    ids=repr,
)
@pytest.mark.parametrize(
    "place",
    [
        "/camera/position/1",
        "/shapes/0/vertices/2/1",
        "/shapes/1/center/0",
        "/shapes/2/edges/1/1",
        "/shapes/3/axes/0/0",
        "/lights/2/position/2",
        "/lights/3/direction/0",
    ],
)
def test_coordinate_bounds(scene: dict[str, Any], place: str, wrong: object) -> None:
    assert list(problems(changed(scene, place, wrong))) == [place]


@pytest.mark.parametrize("wrong", [0, -1, 1e-101, 5e-324, 2e15, "1", True, math.nan], ids=repr)
@pytest.mark.parametrize(
    "place", ["/shapes/1/size/0", "/shapes/4/radius", "/lights/0/size/1", "/camera/focal_length"]
)
def test_size_bounds(scene: dict[str, Any], place: str, wrong: object) -> None:
    assert list(problems(changed(scene, place, wrong))) == [place]


@pytest.mark.parametrize("wrong", [-1e-9, 2e30, "0", True, math.inf], ids=repr)
@pytest.mark.parametrize(
    "place", ["/background/0", "/ambient/2", "/lights/0/color/1", "/materials/plain/color/1"]
)
def test_colour_bounds(scene: dict[str, Any], place: str, wrong: object) -> None:
    assert list(problems(changed(scene, place, wrong))) == [place]


@pytest.mark.parametrize("angle", [0, -10, 180, 200, math.nan, "40"], ids=repr)
def test_field_of_view_bounds(scene: dict[str, Any], angle: object) -> None:
    assert list(problems(changed(scene, "/camera/vertical_fov", angle))) == ["/camera/vertical_fov"]


@pytest.mark.parametrize("count", [0, -1, 1.5, True, "4", 10**9, 10**300, None], ids=repr)
@pytest.mark.parametrize("place", ["/camera/width", "/camera/height", "/sampling/light/samples"])
def test_count_bounds(scene: dict[str, Any], place: str, count: object) -> None:
    assert list(problems(changed(scene, place, count))) == [place]


@pytest.mark.parametrize(
    ("place", "code"),
    [
        ("/camera/up", "zero_vector"),
        ("/shapes/1/normal", "zero_vector"),
        ("/shapes/1/tangent", "zero_vector"),
        ("/lights/0/normal", "zero_vector"),
        ("/lights/3/direction", "zero_vector"),
        ("/shapes/2/edges/0", "no_length"),
        ("/lights/1/edges/1", "no_length"),
        ("/shapes/3/axes/2", "no_length"),
    ],
)
def test_vector_without_a_direction(scene: dict[str, Any], place: str, code: str) -> None:
    assert problems(changed(scene, place, [0, -0.0, 0])) == {place: code}


@pytest.mark.parametrize("tangent", [[0, 1, 0], [0, -7, 0], [1e-12, 1, 0]])
@pytest.mark.parametrize("figure", ["/shapes/1", "/lights/0"])
def test_tangent_along_the_normal(scene: dict[str, Any], figure: str, tangent: list[float]) -> None:
    assert problems(changed(scene, f"{figure}/tangent", tangent)) == {f"{figure}/tangent": "parallel"}


@pytest.mark.parametrize("size", [1e-300, 5e-324, 1e15])
def test_directions_of_any_length(scene: dict[str, Any], size: float) -> None:
    scene["shapes"][1].update(normal=[0, size, 0], tangent=[size, size, 0])
    scene["camera"]["up"] = [0, size, 0]
    assert read_scene(scene)[1] == ()


@pytest.mark.parametrize("edges", [[[1, 0, 0], [-2, 0, 0]], [[0.1, 0.2, 0.3], [0.3, 0.6, 0.9]]])
@pytest.mark.parametrize("figure", ["/shapes/2", "/lights/1"])
def test_rectangle_without_area(scene: dict[str, Any], figure: str, edges: object) -> None:
    assert problems(changed(scene, f"{figure}/edges", edges)) == {f"{figure}/edges": "no_area"}


@pytest.mark.parametrize("scale", [1e-90, 1.0, 1e14])
def test_axes_that_are_not_perpendicular(scene: dict[str, Any], scale: float) -> None:
    axes = [[scale, 0, 0], [2e-6 * scale, scale, 0], [0, 0, scale]]
    assert problems(changed(scene, "/shapes/3/axes", axes)) == {"/shapes/3/axes": "not_perpendicular"}


def test_camera_where_it_looks(scene: dict[str, Any]) -> None:
    with pytest.raises(SceneError) as caught:
        read_scene(changed(scene, "/camera/look_at", [0, 2, 8]))
    (problem,) = caught.value.errors
    assert problem.pointer == "/camera/look_at"
    assert "'look_at'" in problem.detail
    assert "'position'" in problem.detail


@pytest.mark.parametrize("pattern", ["uniform", "rotated"])
@pytest.mark.parametrize("samples", [2, 15, 17, 65535])
def test_grid_of_samples_is_square(scene: dict[str, Any], pattern: str, samples: int) -> None:
    wrong = changed(scene, "/sampling/antialiasing", {"pattern": pattern, "samples": samples})
    assert problems(wrong) == {"/sampling/antialiasing/samples": "not_square"}


def test_center_pattern_has_one_sample(scene: dict[str, Any]) -> None:
    wrong = changed(scene, "/sampling/antialiasing", {"pattern": "center", "samples": 4})
    assert problems(wrong) == {"/sampling/antialiasing/samples": "one_sample"}
    assert Antialiasing(pattern="center").samples == 1


@pytest.mark.parametrize("colors", [{}, {"color": [1, 1, 1], "color_texture": "wood"}])
def test_material_has_one_color(scene: dict[str, Any], colors: dict[str, object]) -> None:
    wrong = changed(scene, "/materials/plain", {"type": "phong", **colors})
    assert problems(wrong) == {"/materials/plain": "one_color"}


@pytest.mark.parametrize(
    ("place", "code"),
    [
        ("/shapes/0/material", "unknown_material"),
        ("/materials/carved/color_texture", "unknown_texture"),
        ("/materials/carved/normal_map", "unknown_texture"),
    ],
)
def test_undefined_names(scene: dict[str, Any], place: str, code: str) -> None:
    assert problems(changed(scene, place, "nowhere")) == {place: code}


def test_checker_is_no_normal_map(scene: dict[str, Any]) -> None:
    wrong = changed(scene, "/materials/carved/normal_map", "board")
    assert problems(wrong) == {"/materials/carved/normal_map": "not_an_image"}


@pytest.mark.parametrize(("place", "value"), [("/materials/plain/sheen", 0.5), ("/layers", ["depth"])])
def test_unknown_fields(scene: dict[str, Any], place: str, value: object) -> None:
    assert problems(changed(scene, place, value)) == {place: "unknown_field"}


@pytest.mark.parametrize(
    ("limits", "place"),
    [
        (Limits(max_pixels=100), "/camera"),
        (Limits(max_samples=15), "/sampling/antialiasing/samples"),
        (Limits(max_light_samples=6), "/sampling/light/samples"),
        (Limits(max_shapes=4), "/shapes"),
        (Limits(max_lights=3), "/lights"),
        (Limits(max_materials=1), "/materials"),
        (Limits(max_textures=1), "/textures"),
    ],
)
def test_scene_beyond_a_limit(scene: dict[str, Any], limits: Limits, place: str) -> None:
    with pytest.raises(SceneError) as caught:
        read_scene(json.dumps(scene), limits=limits)
    assert [(problem.pointer, problem.code) for problem in caught.value.errors] == [(place, "over_limit")]


def test_scene_at_its_limits(scene: dict[str, Any]) -> None:
    limits = Limits(
        max_pixels=512 * 512,
        max_samples=16,
        max_light_samples=7,
        max_shapes=5,
        max_lights=5,
        max_materials=2,
        max_textures=2,
    )
    read_scene(json.dumps(scene), limits=limits)


def mesh(**changes: Any) -> dict[str, Any]:
    corners = [[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]]
    faces = [[0, 1, 2], [0, 1, 3]]
    return {"type": "mesh", "vertices": corners, "triangles": faces, "material": "plain", **changes}


def with_shape(scene: dict[str, Any], shape: dict[str, Any]) -> dict[str, Any]:
    name = next(iter(scene["materials"]))
    return {**scene, "shapes": [{**shape, "material": name}]}


@pytest.mark.parametrize(
    ("shape", "pointer", "code"),
    [
        (mesh(triangles=[[0, 1, 2], [0, 4, 1]]), "/shapes/0/triangles/1/1", "no_such_vertex"),
        (mesh(triangles=[[0, 1, 2], [0, -1, 1]]), "/shapes/0/triangles/1/1", "out_of_range"),
        (mesh(triangles=[[0, 1, 2], [0, 1.5, 1]]), "/shapes/0/triangles/1/1", "not_whole"),
        (mesh(triangles=[]), "/shapes/0/triangles", "wrong_length"),
        (mesh(uvs=[[0, 0]] * 3), "/shapes/0/uvs", "not_one_each"),
        (mesh(scale=0), "/shapes/0/scale", "out_of_range"),
        (mesh(scale=True), "/shapes/0/scale", "not_a_number"),
        (mesh(scale=[1]), "/shapes/0/scale", "wrong_length"),
        (mesh(scale=[1, 1, -1e-101]), "/shapes/0/scale/2", "out_of_range"),
        (mesh(scale=[1, -2e15, -1]), "/shapes/0/scale/1", "out_of_range"),
        (mesh(rotate={"axis": [0, 0, 0], "degrees": 3}), "/shapes/0/rotate/axis", "zero_vector"),
        ({"type": "mesh", "asset": ""}, "/shapes/0/asset", "wrong_length"),
    ],
)
def test_wrong_mesh_is_located(scene: dict[str, Any], shape: dict[str, Any], pointer: str, code: str) -> None:
    found = problems(with_shape(scene, shape))
    assert list(found) == [pointer], found
    assert found[pointer] == code


@pytest.mark.parametrize(("mirror", "refused"), [(0.25, False), (0.26, True)])
def test_material_keeps_energy(scene: dict[str, Any], mirror: float, refused: bool) -> None:
    name = next(iter(scene["materials"]))
    scene["materials"][name].update(mirror=mirror, transmission=0.75)
    if not refused:
        read_scene(scene)
        return
    with pytest.raises(SceneError) as caught:
        read_scene(scene)
    assert [(p.pointer, p.code) for p in caught.value.errors] == [(f"/materials/{name}", "more_than_all")]
