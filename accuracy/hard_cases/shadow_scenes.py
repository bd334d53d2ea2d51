"""Floors, what floats above them, and lights, anywhere and of any size, with what is seen from where."""

import io
import itertools
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
from PIL import Image

import renderer
from accuracy.hard_cases.documents import (
    Json,
    bulb,
    camera,
    ellipsoid,
    lamp,
    phong,
    rectangle,
    sampled,
    scene,
    triangle,
)
from accuracy.hard_cases.documents import sun as sunlight
from renderer.math.arrays import Floats
from schemas.quality import FixedQuality

OFFSETS = (0.0, 1e2, 1e3, 1e4, 1e5, 1e6, 1e7)
"""Distances of the scene from the origin, in shares of its own size."""

SCALES = tuple(2.0**exponent for exponent in (-20, -10, 0, 10, 20))
PATTERNS = ("uniform", "random", "stratified", "sobol")
PRECISIONS = (FixedQuality(mode="fixed", precision="single"), FixedQuality(mode="fixed", precision="double"))

FLOORS = ("tiles", "triangles", "mesh", "relief")
"""Four parallelograms, 8 triangles, a mesh of 72, which are in a tree, and a displaced rectangle."""

COVERS = ("rectangle", "triangles", "mesh", "ellipsoid")

RELIEF = {
    "textures": {
        "white": {
            "type": "image",
            "asset": "white",
            "encoding": "linear",
            "filter": "bilinear",
            "wrap": "clamp",
        }
    }
}


class White:
    """One file: a picture that is white all over."""

    def read(self, name: str) -> bytes:
        """The picture, whatever it is called."""
        del name
        buffer = io.BytesIO()
        Image.new("L", (2, 2), 255).save(buffer, format="PNG")
        return buffer.getvalue()


@dataclass(frozen=True, slots=True, eq=False)
class Place:
    """A frame that a scene is written in.

    Attributes
    ----------
    center : (3,) float64
    axes : (3, 3) float64
        Unit rows: across, along and up.
    unit : float
        Length of 1, scene units.
    """

    center: Floats
    axes: Floats
    unit: float

    def way(self, *steps: Any) -> Floats:
        """A vector, or vectors (N, 3), by steps across, along and up."""
        return self.unit * np.stack(np.broadcast_arrays(*steps), axis=-1) @ self.axes

    def at(self, *steps: Any) -> Floats:
        """A place, or places (N, 3), by steps from the centre."""
        return self.center + self.way(*steps)


def turned(chosen: np.random.Generator) -> Floats:
    """Three perpendicular unit vectors as rows."""
    return np.linalg.qr(chosen.normal(size=(3, 3)))[0].T


def places(
    name: str, offsets: Sequence[float] = OFFSETS, scales: Sequence[float] = (1.0,), turns: int = 1
) -> Iterator[tuple[np.random.Generator, Place]]:
    """Places at all offsets and of all scales, each with numbers to draw more from."""
    for number, (offset, unit, _) in enumerate(itertools.product(offsets, scales, range(turns))):
        chosen = np.random.default_rng([number, *name.encode()])
        center = chosen.normal(size=3) * offset * unit
        yield chosen, Place(center, turned(chosen), unit)


@dataclass(frozen=True, slots=True, eq=False)
class View:
    """Rays on a scene, and how much of each light is seen from where they end.

    Attributes
    ----------
    shapes, lights : list of dict
        Of the scene language.
    floors : int
        So many of the shapes, the first ones, are what the rays have to meet.
    origins, directions : (N, 3) float64
    seen : (N, lights) float64
        Share of each light, 0 to 1.
    changes : dict
        Of the rest of the scene.
    """

    shapes: list[Json]
    lights: list[Json]
    floors: int
    origins: Floats
    directions: Floats
    seen: Floats
    changes: Json = field(default_factory=dict)

    def hits(self, precision: FixedQuality, pattern: str = "uniform", points: int = 9) -> renderer.Hits:
        """What Penumbra says of the rays."""
        written = scene(
            *self.shapes, lights=self.lights, sampling=sampled(1, points, light=pattern), **self.changes
        )
        loaded = renderer.load_scene(written, assets=White())
        return renderer.trace(renderer.compile_scene(loaded, precision), self.origins, self.directions)

    def wrong(self, precision: FixedQuality, pattern: str = "uniform", points: int = 9) -> int:
        """Pairs of ray and light of which Penumbra says something else."""
        hits = self.hits(precision, pattern, points)
        on_floor = (hits.shape >= 0) & (hits.shape < self.floors)
        return int(np.count_nonzero((hits.visibility != self.seen) | ~on_floor[:, None]))


def floor(kind: str, place: Place) -> list[Json]:
    """Ten units square, flat, made of neighbours that share corners."""
    sides = {"tiles": 2, "triangles": 2, "mesh": 6, "relief": 1}[kind]
    steps = np.linspace(-5, 5, sides + 1)
    if kind in ("tiles", "relief"):
        edges = place.way(10 / sides, 0, 0).tolist(), place.way(0, 10 / sides, 0).tolist()
        corners = [place.at(x, y, 0).tolist() for x in steps[:-1] for y in steps[:-1]]
        material = "relief" if kind == "relief" else "plain"
        return [rectangle(corner, *edges, material=material) for corner in corners]
    vertices, faces = grid(place, steps, 0.0)
    return triangulated(kind, vertices, faces)


def grid(place: Place, steps: Floats, height: Any) -> tuple[Floats, list[tuple[int, int, int]]]:
    """Vertices (V, 3) of a square grid and two triangles a cell, fronts up."""
    x, y = (part.ravel() for part in np.meshgrid(steps, steps, indexing="ij"))
    size = steps.size
    cells = [size * i + j for i in range(size - 1) for j in range(size - 1)]
    lower = [(c, c + size, c + size + 1) for c in cells]
    return place.at(x, y, height), lower + [(c, c + size + 1, c + 1) for c in cells]


def triangulated(kind: str, vertices: Floats, faces: Sequence[tuple[int, int, int]]) -> list[Json]:
    """Triangles one by one, or as one mesh."""
    if kind == "mesh":
        return [{"type": "mesh", "vertices": vertices.tolist(), "triangles": faces, "material": "plain"}]
    return [triangle(*(vertices[i].tolist() for i in face)) for face in faces]


def relief(place: Place) -> Json:
    """What a scene says of a floor that is displaced by a tenth of a unit everywhere."""
    above = place.at(0, 0, 9)
    return {
        **RELIEF,
        "materials": {
            "plain": phong(),
            "relief": phong(displacement_map="white", displacement_height=place.unit / 10),
        },
        "camera": camera(position=above.tolist(), look_at=place.center.tolist(), up=place.axes[1].tolist()),
    }


def cover(kind: str, place: Place, middle: Floats) -> list[Json]:
    """Eighteen units wide and flat, about a place above the floor."""
    here = Place(middle, place.axes, place.unit)
    if kind == "rectangle":
        edges = place.way(18, 0, 0).tolist(), place.way(0, 18, 0).tolist()
        return [rectangle(here.at(-9, -9, 0).tolist(), *edges)]
    if kind == "ellipsoid":
        height = float(np.linalg.norm((middle - place.center) @ place.axes[2])) / place.unit
        axes = (place.way(12, 0, 0), place.way(0, 12, 0), place.way(0, 0, height / 4))
        return [ellipsoid(middle.tolist(), *(axis.tolist() for axis in axes))]
    steps = np.linspace(-9, 9, 2 if kind == "triangles" else 6)
    return triangulated(kind, *grid(here, steps, 0.0))


def lights(place: Place, way: Floats) -> list[Json]:
    """A bulb, a lamp and a sun in one direction."""
    position = place.center + way
    first, second = place.way(0.1, 0, 0).tolist(), place.way(0, 0.1, 0).tolist()
    return [
        bulb(position.tolist()),
        lamp(position.tolist(), first, second, visible=False),
        sunlight((-way).tolist()),
    ]


def bare(kind: str, place: Place, chosen: np.random.Generator, count: int = 40) -> View:
    """A floor and nothing above it, seen and lit at angles down to 3e-3: all lights are seen whole."""
    angle = 10 ** chosen.uniform(-2.5, 0)
    high = 0.1 if kind == "relief" else 0.0
    shapes = [*floor(kind, place)]
    way = place.way(8 * np.cos(angle), 0, 8 * np.sin(angle) + high)
    view = 10 ** chosen.uniform(-2.5, 0, count)
    return _viewed(place, shapes, lights(place, way), 1.0, (_spread(chosen, count), view, high))


def on_seams(kind: str, place: Place, chosen: np.random.Generator) -> View:
    """The same, seen exactly on the lines where the parts of the floor meet, as well as doubles can say."""
    sides = {"tiles": 2, "triangles": 2, "mesh": 6}[kind]
    inner = chosen.choice(np.linspace(-5, 5, sides + 1)[1:-1], 20)
    along = chosen.uniform(-3, 3, 20)
    # Across the floor, along it, from corner to corner of the cells, and the corners themselves.
    x = np.concatenate((inner, along, along, inner[:5]))
    y = np.concatenate((along, inner, along, inner[:5]))
    angle, view = 10 ** chosen.uniform(-2.5, 0), 10 ** chosen.uniform(-2.5, 0, x.size)
    way = place.way(8 * np.cos(angle), 0, 8 * np.sin(angle))
    return _viewed(place, floor(kind, place), lights(place, way), 1.0, (np.stack((x, y)), view, 0.0))


def covered(kind: str, above: str, share: float, place: Place, chosen: np.random.Generator) -> View:
    """A floor under a cover at a share of the way to the lights: none is seen."""
    angle = chosen.uniform(0.1, 1.5)
    way = place.way(8 * np.cos(angle), 0, 8 * np.sin(angle))
    shapes = [*floor(kind, place)]
    height = share * 8 * np.sin(angle)
    view = 10 ** chosen.uniform(-2.5, -0.5, 40) * min(1.0, height)
    found = _viewed(place, shapes, lights(place, way), 0.0, (_spread(chosen, 40), view, 0.0))
    return replace(found, shapes=[*found.shapes, *cover(above, place, place.center + share * way)])


def partly_covered(kind: str, above: str, place: Place, chosen: np.random.Generator) -> View:
    """A floor under a cover that ends above its middle, and a lamp as wide as half of what is seen of it.

    What share of the lights is seen is not said.
    """
    shining = lights(place, place.way(0.5, 0.25, 6))
    first, second = place.way(3, 0, 0).tolist(), place.way(0, 3, 0).tolist()
    shining.append(lamp(place.at(-1, -1, 5).tolist(), first, second, visible=False))
    high = 0.1 if kind == "relief" else 0.0
    view = chosen.uniform(0.1, 1, 40)
    found = _viewed(place, floor(kind, place), shining, np.nan, (_spread(chosen, 40), view, high))
    middle = place.at({"ellipsoid": 12.0}.get(above, 9.0), 0, 2)
    return replace(found, shapes=[*found.shapes, *cover(above, place, middle)])


def _spread(chosen: np.random.Generator, count: int) -> Floats:
    """Places (2, N) across and along the middle of a floor."""
    return chosen.uniform(-3, 3, (2, count))


def _viewed(
    place: Place,
    shapes: list[Json],
    shining: list[Json],
    seen: float,
    drawn: tuple[Floats, Floats, float],
) -> View:
    """Rays at places (2, N) of a floor, from `view` above it and a unit along."""
    (x, y), view, high = drawn
    targets = place.at(x, y, high)
    origins = targets + place.way(0, 0.5 * np.cos(view), 0.5 * np.sin(view))
    changes = relief(place) if high else {}
    share = np.full((view.size, len(shining)), seen)
    return View(shapes, shining, len(shapes), origins, targets - origins, share, changes)
