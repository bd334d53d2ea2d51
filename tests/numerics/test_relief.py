"""Displacement: closed solids stay closed, flat maps change nothing, and relief casts its shadows."""

from collections import Counter
from collections.abc import Sequence
from typing import Any

import numpy as np
import pytest

import renderer
import schemas.textures as language
from renderer.cameras import build_pinhole
from renderer.shapes import displacement
from renderer.shapes.displacement import Displaced
from renderer.shapes.triangles import Triangles
from renderer.textures import image
from renderer.textures.heights import Heights
from schemas.reading import read_scene
from tests.documents import Json, camera, dark_scene, mesh, phong, rectangle, sphere, sun
from tests.numerics.tracing import QUALITIES
from tests.pictures.parts import DOUBLE, Files, plan_of, png
from tests.solids import outward

Floats = np.ndarray
TEXELS = 64
WHITE = 65535


def hills() -> Floats:
    """Heights (64, 64) that do not repeat, so that no two edges of an image fit."""
    u, v = np.meshgrid(*[(np.arange(TEXELS) + 0.5) / TEXELS] * 2)
    return (WHITE * (0.5 + 0.25 * np.sin(7 * u + 5 * v) + 0.25 * np.cos(9 * u * v))).astype(np.uint16)


def relief_scene(shape: Json, size: int, height: float, **changes: Any) -> Json:
    """A shape moved by the file `map`, before a camera of size x size pixels."""
    view = camera(position=[0.4, 0.7, 6], look_at=[0, 0, 0], vertical_fov=40, width=size, height=size)
    moved = {"displacement_map": "map", "displacement_height": height} if height else {}
    return dark_scene(
        shape,
        camera=view,
        lights=[sun([0.2, -0.1, -1], [1, 1, 1])],
        textures={"map": {"type": "image", "asset": "map", "encoding": "linear"}},
        materials={"plain": phong([1, 1, 1], ambient=0.0, diffuse=1.0, **moved)},
        **changes,
    )


def fine_mesh(document: Json, heights: Floats, scale: float, group: Sequence[int] = (0,)) -> Triangles:
    """The fine triangles of shapes of a scene that are built together, moved by heights of a scale."""
    read = read_scene(document)[0]
    texture = language.ImageTexture.model_validate({"type": "image", "asset": "map", "encoding": "linear"})
    map_ = Heights(image.build(texture, Files({"map": png(heights)})), scale)
    moved = [Displaced(number, read.shapes[number], map_) for number in group]
    return displacement.build(moved, build_pinhole(read.camera), Files())


def cube() -> Json:
    """A cube whose faces share no vertex, each with the whole texture."""
    square = np.array([[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0]])
    vertices: list[list[float]] = []
    faces: list[list[int]] = []
    for axis in range(3):
        for side in (-1.0, 1.0):
            corners = np.insert(square[:: int(side)], 0, side, axis=1)
            faces += [[len(vertices) + k for k in face] for face in ([0, 1, 2], [0, 2, 3])]
            vertices += np.roll(corners, axis, axis=1).tolist()
    return mesh(vertices, faces, uvs=[[0, 0], [1, 0], [1, 1], [0, 1]] * 6)


def open_edges(corners: Floats) -> tuple[int, int]:
    """Edges of triangles (3, 3, T), and how many of them do not have just one neighbour the other way round.

    Triangles with two corners in one place, as at a pole, are none.
    """
    places = np.unique(corners.transpose(0, 2, 1).reshape(-1, 3), axis=0, return_inverse=True)[1]
    numbers = places.reshape(3, -1)
    numbers = numbers[:, (numbers != numbers[[1, 2, 0]]).all(axis=0)]
    edges: Counter[tuple[int, int]] = Counter()
    for start, end in ((0, 1), (1, 2), (2, 0)):
        edges.update(zip(numbers[start].tolist(), numbers[end].tolist(), strict=True))
    return len(edges), sum(not count == edges[b, a] == 1 for (a, b), count in edges.items())


HEIGHT = 0.3
FACES = (
    ((-1, -1, -1), (0, 2, 0), (3, 0, 0)),
    ((-1, -1, 1), (3, 0, 0), (0, 2, 0)),
    ((-1, -1, -1), (0, 0, 2), (0, 2, 0)),
    ((2, -1, -1), (0, 2, 0), (0, 0, 2)),
    ((-1, -1, -1), (3, 0, 0), (0, 0, 2)),
    ((-1, 1, -1), (0, 0, 2), (3, 0, 0)),
)
"""Corners and edges of a box that is longer than high and wide, all faces outwards."""
SOLIDS = {
    "cube": [cube()],
    "smooth mesh": [mesh(*outward([0, 0, 0], 1, 0), smooth=True)],
    "sphere": [sphere([0, 0, 0], 1)],
    "box of rectangles": [rectangle(*np.array(face, dtype=np.float64)) for face in FACES],
}


@pytest.mark.parametrize("shapes", SOLIDS.values(), ids=SOLIDS)
def test_displaced_solid_stays_closed(shapes: list[Json]) -> None:
    """Faces meet with different normals, texture coordinates, or both."""
    document = {**relief_scene(shapes[0], 20, HEIGHT), "shapes": shapes}
    fine = fine_mesh(document, hills(), HEIGHT, range(len(shapes))).vertices
    assert open_edges(fine)[1] == 0
    targets = np.hstack([fine[0], (fine[0] + fine[1]) / 2]).T
    plan = plan_of(document, DOUBLE, files={"map": png(hills())})
    assert np.isfinite(renderer.trace(plan, np.full_like(targets, 0.05), targets - 0.05).t).all()


SLOPE, RIDGE = 0.002, 4e-4
"""Height over length of the sun above a panel, and the height of a ridge on it: 1e-4 of its size."""


@pytest.mark.parametrize("scale", [1e-3, 1.0, 1e3])
def test_low_ridge_casts_its_shadow(scale: float) -> None:
    heights = np.zeros((TEXELS, TEXELS), dtype=np.uint16)
    heights[:, 28:36] = WHITE
    panel = rectangle([-2 * scale, -scale, 0], [4 * scale, 0, 0], [0, 2 * scale, 0])
    document = relief_scene(panel, 160, RIDGE * scale) | {"lights": [sun([1, 0, -SLOPE])]}
    document["camera"] |= {"position": [0, 0, 6 * scale]}
    cell = 4 / np.sqrt(fine_mesh(document, heights, RIDGE).numbers.size / 2)
    # The plateau ends at the middle of column 35, and the slope behind it at that of column 36.
    edge, foot = ((column + 0.5) / TEXELS * 4 - 2 for column in (35, 36))
    end, rng = edge + RIDGE / SLOPE, np.random.default_rng(1)
    dark = rng.uniform(foot + cell, end - cell, 200)
    lit = np.concatenate((rng.uniform(end + cell, 1.9, 200), rng.uniform(-1.9, -foot - cell, 200)))
    x = np.concatenate((dark, lit))
    origins = scale * np.stack((x, rng.uniform(-0.9, 0.9, x.size), np.ones(x.size)), axis=1)
    plan = plan_of(document, DOUBLE, files={"map": png(heights)})
    hits = renderer.trace(plan, origins, np.tile([0.0, 0.0, -1.0], (x.size, 1)))
    assert (hits.visibility[:, 0] == np.repeat([0.0, 1.0], (dark.size, lit.size))).all()


@pytest.mark.parametrize("quality", QUALITIES, ids=["single", "double"])
@pytest.mark.parametrize("scale", [1e-3, 1e3])
@pytest.mark.parametrize("way", [(-1.0, -0.3, 0.5), (-1.0, -0.3, 3.0)], ids=["low sun", "high sun"])
def test_rough_relief_shades_itself_as_its_triangles_do(way: Any, scale: float, quality: Any) -> None:
    """Every fine triangle but the own one is asked; hits within 2^-40 of an edge are left out."""
    chosen, towards, tall = np.random.default_rng(5), np.array(way), 0.5 * scale
    heights = (WHITE * chosen.uniform(0, 1, (64, 64))).astype(np.uint16)
    panel = rectangle(*np.array([[-2.0, -2, 0], [4, 0, 0], [0, 4, 0]]) * scale)
    document = relief_scene(panel, 30, tall) | {"lights": [sun(-towards)]}
    document["camera"]["position"] = [0.4 * scale, 0.7 * scale, 6 * scale]
    targets = scale * np.insert(chosen.uniform(-1.9, 1.9, (120, 2)), 2, 0.0, axis=1)
    origins = targets + scale * np.array([0.3, -0.2, 5])
    hits = renderer.trace(plan_of(document, quality, files={"map": png(heights)}), origins, targets - origins)
    a, b, c = fine_mesh(document, heights, tall).vertices.transpose(0, 2, 1)[:, None]
    first, second, away = b - a, c - a, hits.position[:, None] - a
    across, beside = np.cross(towards, second), np.cross(away, first)
    size = (first * across).sum(axis=-1)
    u, v = (away * across).sum(axis=-1) / size, (beside * towards).sum(axis=-1) / size
    t = (second * beside).sum(axis=-1) / size
    least = np.minimum(np.minimum(u, v), np.minimum(1 - u - v, t))
    least[np.arange(len(least)), hits.primitive] = -1.0
    hidden = (least > 0).any(axis=1) | (hits.normal @ towards <= 0)
    sure = (np.abs(least) > 2.0**-40).all(axis=1)
    assert (hits.visibility[sure, 0] == ~hidden[sure]).all()
    assert not hidden.all()
    assert hidden.any() or way[2] > 1
