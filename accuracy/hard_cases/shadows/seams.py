"""Hard cases E: shadows at seams, on slivers and on rough surfaces."""

import itertools
from collections.abc import Iterator
from functools import partial

import numpy as np

import renderer
from accuracy.hard_cases import solids
from accuracy.hard_cases.documents import Json, bulb, mesh, rectangle, sun, triangle
from accuracy.hard_cases.formulas import by_dtype, moeller_trumbore
from accuracy.hard_cases.harness import QUALITIES, Cases, Outcome, Outcomes, compiled, in_both, png, tally
from accuracy.hard_cases.shadows.occluders import asked
from accuracy.hard_cases.shadows.plain import in_the_way, self_shadowed
from accuracy.hard_cases.shadows.scenes import Place, View, floor, grid, lights, on_seams, places
from accuracy.hard_cases.textures.relief import WHITE, fine_mesh, relief_scene
from renderer.math.arrays import Floats, Masks

COVERS = {"tiles": 2, "triangles": 2, "mesh": 6}
"""Parts along a side of what is above, by its kind."""


def flat_seams() -> Outcomes:
    """Places exactly on the lines where the parts of a floor meet."""

    def views() -> Iterator[tuple[View, list[int]]]:
        for kind in COVERS:
            for chosen, place in places(f"seams {kind}", turns=2):
                view = on_seams(kind, place, chosen)
                yield view, [tally(each) for each in in_both(partial(self_shadowed, view, place, 0.0))]

    return asked(views())


def under_seams() -> Iterator[Outcomes]:
    """A bulb or the sun behind each place of a seam."""
    for number, (kind, shining) in enumerate(itertools.product(COVERS, ("bulb", "sun"))):
        upright = Place(np.zeros(3), np.eye(3), 1.0)
        for chosen, place in [(np.random.default_rng(1), upright), *places(f"under {kind}")]:
            view = _below(kind, shining, place, chosen)
            ends = view.origins + view.directions
            ways = np.array(view.lights[0].get("position", place.at(0, 0, 4e3))) - ends
            plain = (tally(~each) for each in in_both(partial(in_the_way, view.shapes[1:], ends, ways)))
            yield Outcome(view.seen.size, view.wrong(QUALITIES[number % 2]), *plain)


def _below(kind: str, shining: str, place: Place, chosen: np.random.Generator) -> View:
    """A cover two units above a floor, and places from which a light is straight behind a seam of it."""
    steps = np.linspace(-5, 5, COVERS[kind] + 1)
    lifted = Place(place.at(0, 0, 2), place.axes, place.unit)
    vertices, faces = grid(lifted, steps, 0.0)
    seams = solids.edge_places(vertices, np.array(faces), [0.0, 0.25, 1 / 3, 0.5])
    within = np.abs((seams - place.center) @ place.axes[:2].T).max(axis=1) < 4.9 * place.unit
    seams = chosen.permutation(seams[within])[:60]
    light = bulb(place.at(0, 0, 4)) if shining == "bulb" else sun(place.way(0, 0, -1))
    away = seams - place.at(0, 0, 4) if shining == "bulb" else place.way(0, 0, np.full(len(seams), -2))
    targets = seams + away
    origins = targets + place.way(0.25, 0, 1)
    ground = rectangle(place.at(-20, -20, 0), place.way(40, 0, 0), place.way(0, 40, 0))
    shapes = [ground, *floor(kind, lifted)]
    return View(shapes, [light], 1, origins, targets - origins, np.zeros((len(seams), 1)))


def slivers() -> Outcomes:
    """Slivers alone and in meshes, seen and lit from above."""

    def views() -> Iterator[tuple[View, list[int]]]:
        kinds = ("triangle", "rectangle", "mesh")
        for kind, thin in itertools.product(kinds, (1e-2, 1e-4, 1e-6, 1e-8)):
            for chosen, place in places(f"sliver {kind} {thin}", offsets=(0.0, 1.0)):
                view = _on_sliver(kind, thin, place, chosen)
                ends = view.origins + view.directions
                ways = np.array(view.lights[0]["position"]) - ends
                shadowed = in_both(partial(in_the_way, view.shapes[:1], ends, ways))
                yield view, [tally(each) for each in shadowed]

    return asked(views())


def _on_sliver(kind: str, thin: float, place: Place, chosen: np.random.Generator) -> View:
    """A sliver four units long, or a mesh of 64 of them side by side, and something below them."""
    count = 64 if kind == "mesh" else 1
    heights = np.repeat(np.arange(count) * thin, 3) + np.tile([0, 0, thin / 2], count)
    vertices = place.at(np.tile([-2.0, 2.0, 0.3], count), heights, 0)
    shares = chosen.dirichlet([1, 1, 1], 40)[:, :, None]
    targets = (shares * vertices.reshape(-1, 3, 3)[chosen.integers(0, count, 40)]).sum(axis=1)
    origins = np.broadcast_to(place.at(0.3, 0.1, 2), targets.shape)
    below = rectangle(place.at(-9, -9, -9), place.way(1, 0, 0), place.way(0, 1, 0))
    shapes = [_sliver(kind, vertices), below]
    seen = np.ones((40, 3))
    return View(shapes, lights(place, place.way(-1, 0.2, 3)), 1, origins, targets - origins, seen)


def _sliver(kind: str, vertices: Floats) -> Json:
    """Two edges from the first vertex, or triangles with their widest angle at every third."""
    a, b, c = vertices[:3]
    if kind == "rectangle":
        return rectangle(a, b - a, c - a)
    if kind == "triangle":
        return triangle(a, b, c)
    return mesh(vertices, np.arange(len(vertices)).reshape(-1, 3))


def rough_relief() -> Outcomes:
    """Heights drawn at random, and low and high suns."""
    chosen = np.random.default_rng(5)
    heights = (WHITE * chosen.uniform(0, 1, (64, 64))).astype(np.uint16)
    return (
        _rough(heights, chosen, scale, way)
        for scale, way in itertools.product((1e-3, 1.0, 1e3), ((-1.0, -0.3, 0.5), (-1.0, -0.3, 3.0)))
    )


def _rough(
    heights: np.ndarray, chosen: np.random.Generator, scale: float, way: tuple[float, float, float]
) -> Outcome:
    panel = rectangle(*np.array(PANEL) * scale)
    towards, tall = np.array(way), 0.5 * scale
    document = relief_scene(panel, 30, tall)
    document |= {
        "lights": [sun(-towards)],
        "camera": {**document["camera"], "position": [0.4 * scale, 0.7 * scale, 6 * scale]},
    }
    targets = scale * np.insert(chosen.uniform(-1.9, 1.9, (120, 2)), 2, 0.0, axis=1)
    origins = targets + scale * np.array([0.3, -0.2, 5])
    plan = compiled(document, QUALITIES[scale == 1.0], {"map": png(heights)})
    hits = renderer.trace(plan, origins, targets - origins)
    corners = fine_mesh(document, heights, tall).vertices.transpose(0, 2, 1)
    hidden, doubtful = _hidden(corners, hits, towards)
    wrong = (hits.visibility[:, 0] != ~hidden) & ~doubtful
    return Outcome(len(targets), tally(wrong), *_plainly(corners, hits, towards, hidden))


PANEL = ((-2.0, -2.0, 0.0), (4.0, 0.0, 0.0), (0.0, 4.0, 0.0))
"""Corner and edges of a panel that is made rough."""

DOUBTFUL = 2.0**-40
"""Share of a triangle's size within which an edge is passed: a thousand roundings wide."""


def _hidden(corners: Floats, hits: renderer.Hits, towards: Floats) -> tuple[Masks, Masks]:
    """Hits (N,) from which a light in a direction is not seen past triangles (3, T, 3); those in doubt."""
    a, b, c = corners[:, None]
    first, second, away = b - a, c - a, hits.position[:, None] - a
    across = np.cross(towards, second)
    size = (first * across).sum(axis=-1)
    beside = np.cross(away, first)
    u, v = (away * across).sum(axis=-1) / size, (beside * towards).sum(axis=-1) / size
    t = (second * beside).sum(axis=-1) / size
    least = np.minimum(np.minimum(u, v), np.minimum(1 - u - v, t))
    least[np.arange(len(least)), hits.primitive] = -1.0
    own = hits.normal @ towards
    return (least > 0).any(axis=1) | (own <= 0), (np.abs(least) <= DOUBTFUL).any(axis=1)


def _plainly(corners: Floats, hits: renderer.Hits, towards: Floats, hidden: Masks) -> list[int]:
    """What a textbook gets wrong, in float64 and in float32, which asks every triangle, the own one too."""
    found = by_dtype(moeller_trumbore, list(corners), hits.position[:, None], towards)
    return [tally(np.isfinite(t).any(axis=1) != hidden) for t in found]


CASES: Cases = {
    "E15: the seams of a flat floor": flat_seams,
    "E8: a place under a seam": under_seams,
    "E16: a sliver in the light": slivers,
    "E17: a rough relief": rough_relief,
}
