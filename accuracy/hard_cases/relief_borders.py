"""Hard cases: displaced shapes side by side."""

import numpy as np

import renderer
import schemas.textures as language
from accuracy.hard_cases.cases import Outcome, Section, total
from accuracy.hard_cases.documents import Json, rectangle, triangle
from accuracy.hard_cases.rays_seen import Files, plan_of, png
from accuracy.hard_cases.relief import hills, open_edges, relief_scene
from renderer.cameras import pinhole
from renderer.math.arrays import Floats
from renderer.shapes import displacement
from renderer.shapes.displacement import Displaced
from renderer.textures import image
from renderer.textures.heights import Heights
from schemas.reading import read_scene

SECTION = Section("Displaced neighbours")

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
    whole = [rectangle(*(part.tolist() for part in face)) for face in corners]
    halves = [
        triangle(*(part.tolist() for part in half))
        for a, first, second in corners
        for half in ((a, a + first, a + first + second), (a, a + first + second, a + second))
    ]
    return [whole, halves]


@SECTION.case(
    "edges of displaced neighbours",
    symptom="A box of displaced rectangles falls apart: one sees through along all of its edges.",
    cause="Each shape moves the common edge along its own normal by its own heights, and is cut into parts "
    "of its own length.",
    remedy="Shapes of one relief whose borders agree bit for bit are cut alike, and places that they share "
    "move along one normal by one height, the means of theirs.",
    expected="A box stays closed: each fine edge twice, once each way, and no ray from within gets out.",
    source="geometry",
)
def neighbours() -> Outcome:
    """Boxes moved by hills, and for the textbook the same shapes moved one by one."""
    return total(_closed(shapes) for shapes in boxes())


def _closed(shapes: list[Json]) -> Outcome:
    document = {**relief_scene(shapes[0], 30, HEIGHT), "shapes": shapes}
    together = _fine(document, [list(range(len(shapes)))])
    count, wrong = open_edges(together)
    targets = np.hstack([together[0], (together[0] + together[1]) / 2]).T
    hits = renderer.trace(
        plan_of(document, files={"map": png(hills())}), np.full_like(targets, 0.05), targets - 0.05
    )
    lost = int(np.count_nonzero(np.isinf(hits.t)))
    apart = _fine(document, [[number] for number in range(len(shapes))])
    return Outcome(count + len(targets), wrong + lost, textbook=open_edges(apart)[1])


def _fine(document: Json, groups: list[list[int]]) -> Floats:
    """Corners (3, 3, T) of the fine triangles of shapes that are built together, group by group."""
    read = read_scene(document)[0]
    texture = language.ImageTexture.model_validate({"type": "image", "asset": "map", "encoding": "linear"})
    heights = Heights(image.build(texture, Files({"map": png(hills())})), HEIGHT)
    camera = pinhole.build(read.camera)
    built = [
        displacement.build([Displaced(i, read.shapes[i], heights) for i in group], camera, Files())
        for group in groups
    ]
    return np.concatenate([family.vertices for family in built], axis=2)
