"""Bump and displacement maps: slopes, moved surfaces, shadows, and how neighbours are joined."""

import math
from itertools import pairwise
from typing import Any

import numpy as np
import pytest

import renderer
import schemas.textures as language
from renderer.cameras import build_pinhole
from renderer.math.arrays import Floats
from renderer.shapes import displacement
from renderer.shapes.displacement import Displaced
from renderer.textures import image
from renderer.textures.heights import Heights
from schemas.reading import read_scene
from tests.documents import Json, camera, mesh, phong, rectangle, scene, sphere, sun
from tests.pictures import parts

SIZE = 64
TEXTURE = {"type": "image", "asset": "map", "encoding": "linear", "filter": "bilinear", "wrap": "clamp"}
COLOR = np.array([0.8, 0.6, 0.4])
PANEL = rectangle([-2, -1, 0], [4, 0, 0], [0, 2, 0])
BALL = sphere([0, 0, 0], 1)
CUBE = mesh(
    [[x, y, z] for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)],
    [[0, 1, 3], [0, 3, 2], [4, 6, 7], [4, 7, 5], [0, 4, 5], [0, 5, 1], [2, 3, 7], [2, 7, 6], [0, 2, 6],
     [0, 6, 4], [1, 5, 7], [1, 7, 3]],
)  # fmt: skip
LEFT, RIGHT = (rectangle([x, -1, 0], [2, 0, 0], [0, 2, 0]) for x in (-2, 0))

U, V = np.meshgrid((np.arange(SIZE) + 0.5) / SIZE, (np.arange(SIZE) + 0.5) / SIZE)
HILLS = 0.5 + 0.25 * np.sin(6 * np.pi * U) + 0.25 * np.cos(5 * np.pi * V + U)
FLAT = np.ones((SIZE, SIZE))
RIDGE = (np.abs(U - 0.5) < 0.06).astype(float)


def picture_file(heights: np.ndarray) -> bytes:
    """Heights (rows, columns) from 0 to 1, row 0 on the side v = 1, in 16 bits."""
    return parts.png(np.floor(heights * 65535 + 0.5).astype(np.uint16))


def plan_of(heights: np.ndarray, *shapes: Json, size: int = 24, **material: Any) -> renderer.RenderPlan:
    document = scene(
        *shapes,
        camera=camera(position=[0, 0, 6], look_at=[0, 0, 0], vertical_fov=40, width=size, height=size),
        ambient=[1, 1, 1],
        textures={"map": TEXTURE},
        materials={"plain": {"type": "phong", "color": COLOR.tolist(), "specular": 0.3} | material},
        lights=[sun([1, 0, -1], [1, 1, 1])],
    )
    return parts.plan_of(document, files={"map": picture_file(heights)})


def raised(shape: Json, heights: np.ndarray, height: float, **more: Any) -> renderer.RenderPlan:
    return plan_of(heights, shape, displacement_map="map", displacement_height=height, **more)


def test_bump_map_tilts_normals_by_its_slope() -> None:
    plan = plan_of(U, PANEL, bump_map="map", bump_height=1.5, specular=0, ambient=0)
    slope = 1.5 / 4  # over the width of the panel, in scene units
    cosine = np.array([-slope, 0, 1]) @ [-1, 0, 1] / math.sqrt(2) / math.hypot(slope, 1)
    seen = renderer.render(plan).image[12, 6:18]  # away from the borders, where the clamped ramp is flat
    np.testing.assert_allclose(seen, np.tile(COLOR * cosine, (12, 1)), rtol=2e-4)


@pytest.mark.parametrize("shape", [PANEL, BALL, CUBE], ids=["rectangle", "ellipsoid", "mesh"])
def test_bump_map_of_one_height_tilts_no_normal(shape: Json) -> None:
    flat, plain = plan_of(FLAT, shape, bump_map="map", bump_height=2.0), plan_of(FLAT, shape)
    np.testing.assert_allclose(renderer.render(flat).image, renderer.render(plain).image, atol=1e-6)


def test_displaced_plane_moves_by_its_height() -> None:
    targets = np.random.default_rng(1).uniform([-1.9, -0.9], [1.9, 0.9], (200, 2))
    origins = np.column_stack((targets, np.full(200, 3.0)))
    hits = renderer.trace(raised(PANEL, FLAT, 0.25), origins, np.tile([0.0, 0.0, -1.0], (200, 1)))
    np.testing.assert_allclose(hits.t, 2.75, rtol=1e-14)
    np.testing.assert_allclose(hits.uv, (targets / [4, 2]) + 0.5, atol=1e-14)
    assert set(hits.shape) == {0}


def test_displaced_ball_is_a_larger_ball() -> None:
    """Up to its facets: a chord of angle a stays within 1 - cos(a / 2) of its arc, and two cross."""
    plan = raised(BALL, FLAT, 0.2)
    directions = np.random.default_rng(2).normal(size=(500, 3))
    directions /= np.linalg.norm(directions, axis=1, keepdims=True)
    radius = 5 - renderer.trace(plan, 5 * directions, -directions).t
    corners = plan.intersectors[0].family.vertices
    cosines = [(corners[i] * corners[(i + 1) % 3]).sum(axis=0).min() / 1.44 for i in range(3)]
    assert radius.max() <= 1.2 * (1 + 1e-12)
    assert radius.min() >= 1.2 * math.cos(math.acos(min(cosines)) / 2) ** 2


def test_displaced_wall_casts_a_shadow_on_itself() -> None:
    """The light comes from the left at 45 degrees: right of the wall at x = 0 it is dark for its height."""
    image = renderer.render(raised(PANEL, RIDGE, 0.5, size=96, ambient=0.5, specular=0)).image
    np.testing.assert_allclose(image[48, 58], 0.5 * COLOR, rtol=1e-6)
    np.testing.assert_allclose(image[48, 20], COLOR * (0.5 + math.sqrt(0.5)), rtol=1e-5)


def test_displacement_stops_at_its_limit(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(displacement, "MAX_TRIANGLES", 1000)
    for shape in (PANEL, BALL, CUBE):
        family = raised(shape, HILLS, 0.1, size=2000).intersectors[0].family
        assert 500 <= family.numbers.size <= 1100


def relief(scale: float = 0.3) -> Heights:
    texture = language.ImageTexture.model_validate(TEXTURE)
    return Heights(image.build(texture, parts.Files({"map": picture_file(HILLS)})), scale)


def built(shapes: list[Json], *reliefs: Heights) -> list[Floats]:
    """Corners (3, 3, T) of the fine triangles of each shape; one relief for all unless there are more."""
    document = scene(*shapes, camera=camera(position=[0, 0, 6], look_at=[0, 0, 0], width=30, height=30))
    read = read_scene(document | {"materials": {"plain": phong()}})[0]
    given: Any = reliefs or [relief()] * len(shapes)
    displaced = [Displaced(i, shape, given[i]) for i, shape in enumerate(read.shapes)]
    family = displacement.build(displaced, build_pinhole(read.camera), parts.Files())
    return [family.vertices[:, :, family.numbers == i] for i in range(len(shapes))]


def on_seam(corners: Floats) -> Floats:
    """Places (N, 3) with x = 0, each once, from below."""
    places = corners.transpose(0, 2, 1).reshape(-1, 3)
    return np.unique(places[places[:, 0] == 0], axis=0)


SQUARE = mesh(
    [[0, -1, 0], [2, -1, 0], [2, 1, 0], [0, 1, 0]],
    [[0, 1, 2], [0, 2, 3]],
    uvs=[[0, 0], [1, 0], [1, 1], [0, 1]],
)


@pytest.mark.parametrize("right", [RIGHT, SQUARE], ids=["rectangle", "mesh"])
def test_displaced_neighbours_join_at_their_mean_heights(right: Json) -> None:
    """The hills do not repeat: alone, the tiles end at other heights."""
    joined = [on_seam(part) for part in built([LEFT, right])]
    np.testing.assert_array_equal(*joined)
    alone = [on_seam(built([tile])[0]) for tile in (LEFT, right)]
    assert np.abs(alone[0] - alone[1]).max() > 0.01
    np.testing.assert_allclose(joined[0], (alone[0] + alone[1]) / 2, rtol=0, atol=2.0**-50)


@pytest.mark.parametrize(
    ("shapes", "scales"),
    [
        ([LEFT, RIGHT], [0.3, 0.2]),
        ([LEFT, rectangle([0, 1.5, 0], [2, 0, 0], [0, 1, 0]), sphere([0, -3, 0], 1)], [0.3] * 3),
        ([sphere([-1.5, 0, 0], 1), sphere([1.5, 0, 0], 1)], [0.3] * 2),
    ],
    ids=["other relief", "no border", "balls"],
)
def test_displaced_shapes_apart_are_what_they_are_alone(shapes: list[Json], scales: list[float]) -> None:
    reliefs = [relief(scale) for scale in scales]
    if len({*scales}) == 1:
        reliefs = reliefs[:1] * len(scales)
    for part, shape, each in zip(built(shapes, *reliefs), shapes, reliefs, strict=True):
        np.testing.assert_array_equal(part, built([shape], each)[0])


def test_displaced_faces_of_a_plate_join_at_its_rim() -> None:
    front, back = (
        rectangle([-1, -1, 0], *edges) for edges in ([[2, 0, 0], [0, 2, 0]], [[0, 2, 0], [2, 0, 0]])
    )
    for side, corners in zip((1, -1), built([front, back]), strict=True):
        rim = np.abs(corners[:, :2]).max(axis=1) == 1
        assert (corners[:, 2][rim] == 0).all()
        assert (side * corners[:, 2][~rim] > 0).all()


def test_displaced_tiles_in_a_row_are_cut_alike() -> None:
    """As finely as the widest, at one end, is alone; one of another relief at the other does not count."""
    ends = [-6.0, *(0.25 * i - 3 for i in range(13)), 8.0]
    tiles = [rectangle([x, -1, 0], [end - x, 0, 0], [0, 2, 0]) for x, end in pairwise(ends)]
    same, other = relief(), relief(0.2)
    order = np.random.default_rng(1).permutation(len(tiles)).tolist()
    parts = built([tiles[i] for i in order], *(other if i == len(tiles) - 1 else same for i in order))
    row = [parts[order.index(i)] for i in range(len(tiles))]
    narrow, wide, wider = (built([tiles[i]])[0].shape[2] for i in (1, 0, -1))
    assert narrow < wide < wider
    assert [part.shape[2] for part in row] == [wide] * (len(tiles) - 1) + [wider]
    for end, (left, right) in zip(ends[1:-2], pairwise(row[:-1]), strict=True):
        shift = np.array([end, 0, 0])[None, :, None]
        np.testing.assert_array_equal(on_seam(left - shift), on_seam(right - shift))
