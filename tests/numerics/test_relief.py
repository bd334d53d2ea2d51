"""Displacement: closed solids stay closed, flat maps change nothing, and a low ridge casts its shadow."""

from typing import Any

import numpy as np
import pytest

import renderer
from tests.documents import Json, mesh, rectangle, sphere, sun, triangle
from tests.numerics.relief import (
    TEXELS,
    WHITE,
    closed_shapes,
    cube,
    fine_mesh,
    hills,
    open_edges,
    relief_scene,
)
from tests.numerics.tracing import radiance
from tests.pictures.parts import DOUBLE, plan_of, png
from tests.solids import outward

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


def boxes() -> list[list[Json]]:
    """The box as six rectangles, and as twelve triangles."""
    corners = [np.array(face, dtype=np.float64) for face in FACES]
    halves = [
        triangle(*half)
        for a, first, second in corners
        for half in ((a, a + first, a + first + second), (a, a + first + second, a + second))
    ]
    return [[rectangle(*face) for face in corners], halves]


SOLIDS = [*([shape] for shape in closed_shapes()), *boxes()]
NAMES = ["cube", "icosphere", "smooth mesh", "sphere", "ellipsoid", "box of rectangles", "box of triangles"]


@pytest.mark.parametrize("shapes", SOLIDS, ids=NAMES)
def test_displaced_solid_stays_closed(shapes: list[Json]) -> None:
    """Faces meet with different normals, texture coordinates, or both."""
    document = {**relief_scene(shapes[0], 20, HEIGHT), "shapes": shapes}
    fine = fine_mesh(document, hills(), HEIGHT, range(len(shapes))).vertices
    assert open_edges(fine)[1] == 0
    targets = np.hstack([fine[0], (fine[0] + fine[1]) / 2]).T
    plan = plan_of(document, DOUBLE, files={"map": png(hills())})
    assert np.isfinite(renderer.trace(plan, np.full_like(targets, 0.05), targets - 0.05).t).all()


FLAT = {
    "rectangle": rectangle([-1.5, -1, 0.3], [3, 0.2, -0.4], [0.1, 2, 0.3]),
    "cube": cube(),
    "smooth triangle": triangle(
        [-2, -1.5, 0.2], [2, -1, -0.4], [0.3, 2, 0.1], normals=[[-0.5, 0, 1], [0.6, 0, 1], [0, 0.7, 1]]
    ),
    "smooth mesh": mesh(*outward([0, 0, 0], 1.5, 1), smooth=True),
    "sphere": sphere([0, 0, 0], 1.5),
}


@pytest.mark.parametrize("name", FLAT)
def test_flat_height_map_changes_nothing(name: str) -> None:
    """But for the turn of normals within a facet, squared; of a ball its rim is left out."""
    size, black = 30, np.zeros((1, 1), dtype=np.uint16)

    def seen(document: Json) -> Any:
        plan = plan_of(document, DOUBLE, files={"map": png(black)})
        rows, columns = np.divmod(np.arange(size * size, dtype=np.float64), size)
        return radiance(plan, plan.camera.position, plan.camera.directions(columns + 0.5, rows + 0.5))[0]

    document = relief_scene(FLAT[name], size, HEIGHT)
    normals = fine_mesh(document, black, HEIGHT).vertex_normals
    turn = max(np.linalg.norm(normals[i] - normals[i - 1], axis=0).max() for i in range(3))
    before, after = seen(relief_scene(FLAT[name], size, 0.0)), seen(document)
    chosen = before > (0.6 if name == "sphere" else -1)
    assert np.abs(after - before)[chosen].max() <= turn**2 + 2.0**-40


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
