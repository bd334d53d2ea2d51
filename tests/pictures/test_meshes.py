"""Pictures of meshes."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest

import renderer
from renderer.shapes import meshes
from schemas.reading import read_scene
from tests import documents, solids
from tests.documents import (
    Json,
    bulb,
    camera,
    lamp,
    phong,
    rectangle,
    sampled,
    scene,
    sphere,
    sun,
    triangle,
)
from tests.pictures.parts import Files, image_of, plan_of, png

ROOT = Path(__file__).parents[2]
VERTICES, FACES = solids.outward([0.0, 1.0, 0.0], 1.0, 2)
FLOOR = rectangle([-3, 0, -3], [0, 0, 6], [6, 0, 0])
LAMP = lamp([1, 4, 1], [1, 0, 0], [0, 0, 1])


def mesh(vertices: Any = VERTICES, triangles: Any = FACES, **more: Any) -> Json:
    return documents.mesh(vertices, triangles, **more)


def mesh_file(asset: str, **more: Any) -> Json:
    return {"type": "mesh", "asset": asset, "material": "plain", **more}


def lit(*shapes: Json, **changes: Any) -> Json:
    return scene(*shapes, lights=[LAMP], **{"sampling": sampled(4, 16), **changes})


def one_by_one(vertices: Any, triangles: Any) -> list[Json]:
    return [triangle(*(list(map(float, vertices[i])) for i in row)) for row in triangles]


def test_mesh_equals_its_triangles() -> None:
    expected = image_of(lit(FLOOR, *one_by_one(VERTICES, FACES)))
    np.testing.assert_array_equal(image_of(lit(FLOOR, mesh())), expected)
    halves = [mesh(triangles=FACES[:100]), mesh(triangles=FACES[100:])]
    np.testing.assert_array_equal(image_of(lit(halves[0], FLOOR, halves[1])), expected)


CORNER = (
    [[-2, 0, -2], [2, 0, -2], [2, 0, 2], [-2, 0, 2], [0, 0, -2], [0, 1, -2], [0, 1, 2], [0, 0, 2]],
    [[0, 2, 1], [0, 3, 2], [4, 5, 6], [4, 6, 7]],
)
"""A floor and, across its middle, a wall of height 1."""
FAR = mesh(VERTICES * 0.1 + [0, 500.0, 0])
"""320 triangles out of every light's way."""
WAYS = {
    "sun": sun([1, -1, 0]),
    "bulb": bulb([-4, 4, 0]),
    "lamp": lamp([-4.05, 4.05, -0.1], [0.1, -0.1, 0], [0, 0, 0.2]),
}


@pytest.mark.parametrize("light", WAYS)
@pytest.mark.parametrize("smooth", [False, True])
@pytest.mark.parametrize("far", [(), (FAR,)], ids=["few triangles", "many"])
def test_mesh_shades_itself(light: str, smooth: bool, far: tuple[Json, ...]) -> None:
    """From -x, 45 degrees high: the shadow ends one height behind the wall, behind bulb and lamp a third on.

    The rays come from above, beside the wall; places next to an end of the shadow are left out.
    """
    x, z = np.meshgrid([*np.linspace(-1.8, -0.1, 9), *np.linspace(0.1, 1.8, 18)], np.linspace(-0.9, 0.9, 7))
    origins = np.stack([x.ravel(), np.full(x.size, 5.0), z.ravel()], axis=1)
    end = 1.0 if light == "sun" else 4 / 3
    sure = np.abs(origins[:, 0] - end) > 0.05
    plan = plan_of(scene(mesh(*CORNER, smooth=smooth), *far, lights=[WAYS[light]], sampling=sampled(1, 4)))
    seen = renderer.trace(plan, origins[sure], np.tile([0.0, -1, 0], (sure.sum(), 1))).visibility[:, 0]
    shaded = (origins[sure, 0] > 0) & (origins[sure, 0] < end)
    np.testing.assert_array_equal(seen, np.where(shaded, 0.0, 1.0))


def test_few_triangles_equal_a_tree() -> None:
    """Twelve triangles are tested one by one; with others far away, through a tree."""
    vertices, faces = solids.icosphere([0.0, 1.0, 0.0], 1.0, 0)
    hidden = mesh(VERTICES * 0.1 + [0, 0, 500.0], name="behind the camera and the light")
    few, many = lit(FLOOR, mesh(vertices, faces)), lit(FLOOR, mesh(vertices, faces), hidden)
    difference = np.abs(image_of(few) - image_of(many))
    # Pairs may be decided in float32 or float64: a light point on an edge may go either way.
    assert (difference > 0).mean() < 0.01


def test_meshes_beside_other_shapes() -> None:
    """Which triangle is in which family changes nothing."""
    ball, extra = sphere([1.5, 0.7, 0.5], 0.7), one_by_one(VERTICES - [2, 0, 0], FACES)
    together = lit(FLOOR, ball, mesh(), *extra)
    apart = lit(FLOOR, ball, mesh(), mesh(VERTICES - [2, 0, 0]))
    np.testing.assert_array_equal(image_of(together), image_of(apart))


def test_trace_names_the_triangle() -> None:
    plan = plan_of(lit(sphere([0, -9, 0], 1), mesh(), mesh(VERTICES - [-5, 0, 0])))
    middles = VERTICES[FACES].mean(axis=1)
    directions = middles - [0, 1, 0]
    for shape, offset in ((1, 0), (2, 5)):
        places = np.add(middles, [offset, 0, 0])
        hits = renderer.trace(plan, places + directions, -directions)
        assert (hits.shape == shape).all()
        assert hits.primitive.tolist() == list(range(len(FACES)))
        np.testing.assert_allclose(hits.position, places, atol=1e-12)


def test_texture_coordinates() -> None:
    vertices, uvs = [[0, 0, 0], [2, 0, 0], [0, 2, 0]], [[0.1, 0.2], [0.5, 0.3], [0.2, 0.9]]
    for given, expected in ((uvs, [0.1 + 0.1 + 0.025, 0.2 + 0.025 + 0.175]), (None, [0.25, 0.25])):
        shape = mesh(vertices, [[0, 1, 2]], uvs=given)
        hits = renderer.trace(plan_of(scene(shape)), [[0.5, 0.5, 1]], [[0, 0, -1.0]])
        np.testing.assert_allclose(hits.uv, [expected], atol=1e-15)


def test_placement() -> None:
    turn = {"axis": [0, 0, 3], "degrees": 90}
    shape = mesh(
        [[1, 0, 0], [0, 1, 0], [0, 0, 1]], [[0, 1, 2]], scale=[2, 3, 4], rotate=turn, translate=[7, 8, 9]
    )
    family = meshes.build([0], [read_scene(scene(shape))[0].shapes[0]], Files())
    expected = [[7, 10, 9], [4, 8, 9], [7, 8, 13]]
    np.testing.assert_allclose(family.vertices[:, :, 0], expected, rtol=0, atol=4e-15)


@pytest.mark.parametrize(
    ("scale", "smooth"), [(-1.0, True), ([-0.5, 1, 2], False), ([-1, -2, 1], True)], ids=str
)
def test_negative_scale(scale: Any, smooth: bool) -> None:
    """Glass with a board on it. By hand: vertices multiplied, and after one or three mirrors turned over."""
    factors = np.broadcast_to(scale, 3)
    faces = FACES[:, [0, 2, 1]] if np.prod(factors) < 0 else FACES
    place = {"translate": [0, 1.5, 0], "smooth": smooth, "uvs": VERTICES[:, :2].tolist()}
    glass = phong(color_texture="board", specular=0.3, transmission=0.5)
    board = {"textures": {"board": {"type": "checker"}}, "materials": {"plain": glass}}
    by_scale, by_hand = (
        plan_of(lit(FLOOR, shape, **board, sampling=sampled(1)))
        for shape in (mesh(scale=scale, **place), mesh(VERTICES * factors, faces, **place))
    )
    np.testing.assert_array_equal(renderer.render(by_scale).image, renderer.render(by_hand).image)
    starts = np.add((VERTICES * factors)[FACES].mean(axis=1), [5, 6.5, 5])
    first, second = (renderer.trace(plan, starts, [[-1, -1, -1]] * 320) for plan in (by_scale, by_hand))
    assert (first.shape == 1).any()
    for name in ("normal", "uv", "primitive", "visibility"):
        np.testing.assert_allclose(getattr(first, name), getattr(second, name), rtol=0, atol=2.0**-50)


@pytest.mark.parametrize("degrees", [0.0, 1e-9, 37.0, -120.0, 180.0, 720.5])
def test_rotation(degrees: float) -> None:
    rng = np.random.default_rng(3)
    points, axis = rng.normal(size=(30, 3)), rng.normal(size=3)
    points[0] = axis
    shape = mesh(points, [[0, 1, 2]], rotate={"axis": axis.tolist(), "degrees": degrees})
    turned = meshes.placed(points.T, read_scene(scene(shape))[0].shapes[0]).T
    np.testing.assert_allclose(turned[0], axis, atol=1e-15)
    np.testing.assert_allclose(turned @ turned.T, points @ points.T, atol=3e-14)
    cross = np.cross(axis, points[1])
    across = points[1] - axis * (points[1] @ axis) / (axis @ axis)
    angle = np.arctan2(turned[1] @ cross / np.linalg.norm(axis), turned[1] @ across)
    assert np.isclose(np.cos(angle), np.cos(np.radians(degrees)), atol=1e-12)
    assert np.isclose(np.sin(angle), np.sin(np.radians(degrees)), atol=1e-12)


def test_smooth_normals() -> None:
    """Three faces of a cube, one of them cut in two: the corner's normal is the diagonal all the same."""
    vertices = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1], [1, 1, 0], [0, 1, 1], [1, 0, 1]])
    faces = np.array([[0, 2, 4], [0, 4, 1], [0, 3, 5], [0, 5, 2], [0, 1, 3], [1, 6, 3]])
    normals = meshes.smooth_normals(vertices.T.astype(float), faces.T)
    np.testing.assert_allclose(normals[:, 0], [-(3**-0.5)] * 3, atol=1e-15)
    np.testing.assert_allclose(np.linalg.norm(normals, axis=0), 1, atol=1e-15)


def test_smooth_ball_is_nearly_a_sphere() -> None:
    view = camera(position=[0.5, 1.6, 2.2], look_at=[0, 1, 0], vertical_fov=25)
    document = {"camera": view, "materials": {"plain": phong(specular=0.5, shininess=20)}}
    true = image_of(lit(sphere([0, 1, 0], 1), **document))
    smooth = np.abs(image_of(lit(mesh(smooth=True), **document)) - true)
    flat = np.abs(image_of(lit(mesh(), **document)) - true)
    assert (smooth**2).mean() < (flat**2).mean() / 4


SQUARE = b"v 0 0 0\nv 1 0 0\nv 1 1 0\nf 1 2 3\n"
MAPPED = b"v 0 0 0\nv 1 0 0\nv 1 1 0\nvt 0 0\nvt 1 0\nvt 1 1\nf 1/1 2/2 3/3\n"


@pytest.mark.parametrize(
    "more", [{}, {"displacement_map": "heights", "displacement_height": 0.1}], ids=["still", "displaced"]
)
def test_missing_texture_coordinates(more: Json) -> None:
    files = {"bare": SQUARE, "mapped": MAPPED, "h.png": png(np.zeros((2, 2, 3), dtype=np.uint8))}
    textures = {"board": {"type": "checker"}, "heights": {"type": "image", "asset": "h.png"}}
    shapes = [mesh_file("mapped"), mesh_file("bare"), mesh_file("bare")]
    textured = {"textures": textures, "materials": {"plain": phong(color_texture="board", **more)}}

    def warned(*shapes: Json, **changes: Any) -> list[tuple[str, str]]:
        found = plan_of(lit(*shapes, **changes), files=files).warnings
        return [(each.pointer, each.detail) for each in found if each.code == "no_texture_coordinates"]

    ((pointer, detail),) = warned(*shapes, **textured)
    assert pointer == "/shapes/1/asset"
    assert "'color_texture'" in detail
    assert "1 other shape " in detail
    assert not warned(*shapes)
    assert not warned(shapes[0], **textured)
