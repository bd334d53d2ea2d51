"""Pictures of meshes."""

from typing import Any

import numpy as np
import pytest

import renderer
from renderer.shapes import meshes
from schemas.reading import read_scene
from tests import documents, solids
from tests.documents import Json, lamp, phong, rectangle, sampled, scene, sphere
from tests.pictures.parts import Files, plan_of

VERTICES, FACES = solids.outward([0.0, 1.0, 0.0], 1.0, 2)
FLOOR = rectangle([-3, 0, -3], [0, 0, 6], [6, 0, 0])
LAMP = lamp([1, 4, 1], [1, 0, 0], [0, 0, 1])


def mesh(vertices: Any = VERTICES, triangles: Any = FACES, **more: Any) -> Json:
    return documents.mesh(vertices, triangles, **more)


def mesh_file(asset: str, **more: Any) -> Json:
    return {"type": "mesh", "asset": asset, "material": "plain", **more}


def lit(*shapes: Json, **changes: Any) -> Json:
    return scene(*shapes, lights=[LAMP], **{"sampling": sampled(4, 16), **changes})


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


def test_smooth_normals() -> None:
    """Three faces of a cube, one of them cut in two: the corner's normal is the diagonal all the same."""
    vertices = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1], [1, 1, 0], [0, 1, 1], [1, 0, 1]])
    faces = np.array([[0, 2, 4], [0, 4, 1], [0, 3, 5], [0, 5, 2], [0, 1, 3], [1, 6, 3]])
    normals = meshes.smooth_normals(vertices.T.astype(float), faces.T, np.arange(7))
    np.testing.assert_allclose(normals[:, 0], [-(3**-0.5)] * 3, atol=1e-15)
    np.testing.assert_allclose(np.linalg.norm(normals, axis=0), 1, atol=1e-15)


SQUARE = b"v 0 0 0\nv 1 0 0\nv 1 1 0\nf 1 2 3\n"
MAPPED = b"v 0 0 0\nv 1 0 0\nv 1 1 0\nvt 0 0\nvt 1 0\nvt 1 1\nf 1/1 2/2 3/3\n"


def test_missing_texture_coordinates() -> None:
    files = {"bare": SQUARE, "mapped": MAPPED}
    shapes = [mesh_file("mapped"), mesh_file("bare"), mesh_file("bare")]
    textured = {
        "textures": {"board": {"type": "checker"}},
        "materials": {"plain": phong(color_texture="board")},
    }

    def warned(*shapes: Json, **changes: Any) -> list[tuple[str, str]]:
        found = plan_of(lit(*shapes, **changes), files=files).warnings
        return [(each.pointer, each.detail) for each in found if each.code == "no_texture_coordinates"]

    ((pointer, detail),) = warned(*shapes, **textured)
    assert pointer == "/shapes/1/asset"
    assert "'color_texture'" in detail
    assert "1 other shape " in detail
    assert not warned(*shapes)
    assert not warned(shapes[0], **textured)
