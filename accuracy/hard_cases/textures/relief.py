"""Hard cases G: surfaces displaced by a height map, alone and side by side."""

from collections import Counter
from collections.abc import Iterator, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

import renderer
import schemas.textures as language
from accuracy.hard_cases.documents import (
    Json,
    camera,
    dark_scene,
    ellipsoid,
    mesh,
    phong,
    rectangle,
    sphere,
    sun,
    triangle,
)
from accuracy.hard_cases.harness import (
    DOUBLE,
    Cases,
    Files,
    Outcome,
    Outcomes,
    compiled,
    judged,
    png,
    radiance,
    tally,
)
from accuracy.hard_cases.solids import outward
from renderer.cameras import build_pinhole
from renderer.math.arrays import Floats, lengths
from renderer.shapes import displacement
from renderer.shapes.displacement import Displaced
from renderer.shapes.triangles import Triangles
from renderer.textures import image
from renderer.textures.heights import Heights
from schemas.reading import read_scene

TEXELS = 64
WHITE = 65535


def hills() -> NDArray[Any]:
    """Heights (64, 64) that do not repeat, so that no two edges of an image fit."""
    u, v = np.meshgrid(*[(np.arange(TEXELS) + 0.5) / TEXELS] * 2)
    return (WHITE * (0.5 + 0.25 * np.sin(7 * u + 5 * v) + 0.25 * np.cos(9 * u * v))).astype(np.uint16)


def black() -> NDArray[Any]:
    """Heights of 0."""
    return np.zeros((1, 1), dtype=np.uint16)


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


def fine_mesh(document: Json, heights: NDArray[Any], scale: float, group: Sequence[int] = (0,)) -> Triangles:
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


def closed_shapes() -> list[Json]:
    """Solids whose faces meet with different normals, texture coordinates, or both."""
    return [
        cube(),
        mesh(*outward([0, 0, 0], 1, 1)),
        mesh(*outward([0, 0, 0], 1, 0), smooth=True),
        sphere([0, 0, 0], 1),
        ellipsoid([0, 0, 0], [1.2, 0, 0], [0, 0.7, 0], [0, 0, 0.9]),
    ]


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


def edges() -> Iterator[Outcomes]:
    """Solids moved by hills: all fine edges, and rays from the centre at their corners and middles."""
    for shape in closed_shapes():
        document = relief_scene(shape, 20, 0.3)
        moved, still = (fine_mesh(document, hills(), scale) for scale in (0.3, 0.0))
        count, wrong = open_edges(moved.vertices)
        apart = np.stack([_moved_alone(still, corner) for corner in range(3)])
        targets = np.hstack([moved.vertices[0], (moved.vertices[0] + moved.vertices[1]) / 2])
        plan = compiled(document, DOUBLE, {"map": png(hills())})
        lost = tally(np.isinf(renderer.trace(plan, np.zeros_like(targets.T), targets.T).t))
        yield Outcome(count + targets.shape[1], wrong + lost, textbook=open_edges(apart)[1])


def _moved_alone(still: Triangles, corner: int) -> Floats:
    """Corners moved along the normal of their own face, by the height at their own texture coordinates."""
    u, v = still.texture[corner]
    return still.vertices[corner] + still.normals * (0.3 * np.sin(7 * u + 5 * v))


def flat_shapes() -> list[Json]:
    """Shapes that a black height map must leave as they are, to the last of their facets and edges."""
    corners = [[-2, -1.5, 0.2], [2, -1, -0.4], [0.3, 2, 0.1]]
    return [
        rectangle([-1.5, -1, 0.3], [3, 0.2, -0.4], [0.1, 2, 0.3]),
        cube(),
        triangle(*corners, normals=[[-0.5, 0, 1], [0.6, 0, 1], [0, 0.7, 1]]),
        mesh(*outward([0, 0, 0], 1.5, 1), smooth=True),
        sphere([0, 0, 0], 1.5),
    ]


def _flat(shape: Json) -> Outcome:
    size, files = 40, {"map": png(black())}
    document = relief_scene(shape, size, 0.3)
    fine = fine_mesh(document, black(), 0.3)
    # Numbers of vertices by place, as a mesh file would have them.
    places, numbers = np.unique(fine.vertices.transpose(2, 0, 1).reshape(-1, 3), axis=0, return_inverse=True)
    meshed = mesh(places, numbers.reshape(-1, 3), smooth=True)
    before, after, plain = (
        _seen(compiled(each, DOUBLE, files), size)
        for each in (relief_scene(shape, size, 0.0), document, relief_scene(meshed, size, 0.0))
    )
    turn = max(float(lengths(fine.vertex_normals[i] - fine.vertex_normals[i - 1]).max()) for i in range(3))
    allowed = turn**2 + 2.0**-40
    chosen = before > 0.6 if shape["type"] == "ellipsoid" else np.full(before.size, fill_value=True)
    off = np.abs(after - before)[chosen] / allowed
    return judged(off, np.abs(plain - before)[chosen] / allowed)


def _seen(plan: renderer.RenderPlan, size: int) -> Floats:
    rows, columns = np.divmod(np.arange(size * size, dtype=np.float64), size)
    return radiance(plan, plan.camera.position, plan.camera.directions(columns + 0.5, rows + 0.5))[0]


SLOPE = 0.002
"""Height over length of the sun above a panel."""

RIDGE = 4e-4
"""Height of the ridge on the panel, which is 4 units long: 1e-4 of its size."""


def ridge() -> NDArray[Any]:
    """A plateau over the 8 middle columns of 64, white."""
    heights = np.zeros((TEXELS, TEXELS), dtype=np.uint16)
    heights[:, 28:36] = WHITE
    return heights


def _shadow(scale: float) -> Outcome:
    panel = rectangle([-2 * scale, -scale, 0], [4 * scale, 0, 0], [0, 2 * scale, 0])
    view = camera(position=[0, 0, 6 * scale], look_at=[0, 0, 0], vertical_fov=40, width=160, height=160)
    document = relief_scene(panel, 160, RIDGE * scale) | {"camera": view, "lights": [sun([1, 0, -SLOPE])]}
    plan = compiled(document, DOUBLE, {"map": png(ridge())})
    cell = 4 / np.sqrt(fine_mesh(document, ridge(), RIDGE).numbers.size / 2)
    # The plateau ends at the middle of column 35, and the slope behind it at that of column 36.
    edge, foot = ((column + 0.5) / TEXELS * 4 - 2 for column in (35, 36))
    end = edge + RIDGE / SLOPE
    rng = np.random.default_rng(1)
    dark = rng.uniform(foot + cell, end - cell, 200)
    lit = np.concatenate((rng.uniform(end + cell, 1.9, 200), rng.uniform(-1.9, -foot - cell, 200)))
    x = np.concatenate((dark, lit))
    origins = scale * np.stack((x, rng.uniform(-0.9, 0.9, x.size), np.ones(x.size)), axis=1)
    hits = renderer.trace(plan, origins, np.tile([0.0, 0.0, -1.0], (x.size, 1)))
    expected = np.repeat([0.0, 1.0], (dark.size, lit.size))
    plain = _plain_visibility(x * scale, edge * scale, scale)
    return Outcome(x.size, tally(hits.visibility[:, 0] != expected), tally(plain != expected))


def _plain_visibility(x: Floats, edge: float, scale: float) -> Floats:
    """Whether the sun is seen over the edge of the ridge from 1e-3 units above the panel."""
    behind = (x > edge) & (1e-3 + SLOPE * (x - edge) < RIDGE * scale)
    return np.where(behind, 0.0, 1.0)


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
    whole = [rectangle(*face) for face in corners]
    halves = [
        triangle(*half)
        for a, first, second in corners
        for half in ((a, a + first, a + first + second), (a, a + first + second, a + second))
    ]
    return [whole, halves]


def _closed(shapes: list[Json]) -> Outcome:
    document = {**relief_scene(shapes[0], 30, HEIGHT), "shapes": shapes}
    together = fine_mesh(document, hills(), HEIGHT, range(len(shapes))).vertices
    count, wrong = open_edges(together)
    targets = np.hstack([together[0], (together[0] + together[1]) / 2]).T
    plan = compiled(document, DOUBLE, {"map": png(hills())})
    lost = tally(np.isinf(renderer.trace(plan, np.full_like(targets, 0.05), targets - 0.05).t))
    apart = [fine_mesh(document, hills(), HEIGHT, [number]).vertices for number in range(len(shapes))]
    return Outcome(count + len(targets), wrong + lost, open_edges(np.concatenate(apart, axis=2))[1])


CASES: Cases = {
    "G9: edges of displaced faces": edges,
    "G10: flat height maps": lambda: (_flat(shape) for shape in flat_shapes()),
    "G10: the shadow of a fine relief": lambda: (_shadow(scale) for scale in (1e-3, 1.0, 1e3)),
    "G12: edges of displaced neighbours": lambda: (_closed(shapes) for shapes in boxes()),
}
