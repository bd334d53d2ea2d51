"""Surfaces of flat shapes that share edges, and rays in their planes, for triangles and rectangles alike."""

import itertools
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from accuracy.hard_cases import formulas, scoring, solids
from accuracy.hard_cases.documents import Json, mesh, rectangle, scene, triangle
from accuracy.hard_cases.families import FLAT, FamilyCase, Ray
from accuracy.hard_cases.formulas import Formula
from accuracy.hard_cases.harness import Outcome, Outcomes, in_both, tally, traced
from accuracy.hard_cases.scoring import Textbook, flat_details, rounded
from renderer.math.arrays import Floats, Integers, Masks, Pairs
from schemas.reading import read_scene

FAR = (148376.0, 1234.0, -223423.0)
"""Where Embree's own tests put their far spheres."""


@dataclass(frozen=True, slots=True, eq=False)
class Surface:
    """Flat shapes, and rays none of which may miss all of them.

    Attributes
    ----------
    shapes : sequence of Json
    parts : (K, 3, 3) float64
        Three vertices of each triangle, or corner and edges of each rectangle: shape, vector, coordinate.
    origins, directions : (N, 3) float64
    """

    shapes: Sequence[Json]
    parts: Floats
    origins: Floats
    directions: Floats


def leaks(surfaces: Iterator[Surface], formula: Formula) -> Outcomes:
    """Rays that the renderer, and a formula in both precisions, let through."""
    return (_leaks_of(each, formula) for each in surfaces)


def _leaks_of(each: Surface, formula: Formula) -> Outcome:
    hits = traced(each.shapes, each.origins, each.directions)
    found = hits_any(formula, each.parts, each.origins, each.directions)
    return Outcome(len(hits.t), tally(hits.shape < 0), *(tally(~mask) for mask in found))


def hits_any(formula: Formula, parts: Floats, origins: Floats, directions: Floats) -> list[Masks]:
    """Whether a formula finds rays (N, 3) to hit any of some shapes (K, 3, 3), (N,), in both precisions."""
    vectors = list(parts.transpose(1, 0, 2)[:, None])
    found = formulas.by_dtype(formula, vectors, origins[:, None], directions[:, None])
    return [np.asarray(np.isfinite(t).any(axis=1)) for t in found]


def surface(make: Callable[..., Json], parts: Floats, origins: Floats, targets: Floats) -> Surface:
    """Shapes of three vectors each (K, 3, 3), and rays from origins through targets."""
    return Surface([make(*rows) for rows in parts.tolist()], parts, origins, targets - origins)


def pairs_of_triangles() -> Iterator[Surface]:
    """Two triangles with one edge in common, and rays at places of that edge."""
    rng = np.random.default_rng(1)
    for _ in range(100):
        a, b, c, d = rng.normal(size=(4, 3))
        # Across the edge from `a`, so that the rays pass the one or the other on their way.
        d = b + c - a + 0.1 * d
        targets = b + np.outer(rng.uniform(0.05, 0.95, 20), c - b)
        normal = np.cross(b - a, c - a)
        origins = targets + normal / np.linalg.norm(normal) * 3 + rng.normal(size=(20, 3)) * 0.3
        yield surface(triangle, np.array([[a, b, c], [d, c, b]]), origins, targets)


def pairs_in_whole_numbers() -> Iterator[Surface]:
    """The same in whole numbers, with rays that hit the edge without any rounding."""
    rng = np.random.default_rng(2)
    for _ in range(100):
        a, d = rng.integers(-160, 161, (2, 3))
        b, along = rng.integers(-160, 161, 3), rng.integers(-20, 21, 3)
        ways = rng.integers(-160, 161, (100, 3))
        # The planes of edge and ray that have the one triangle on this side and the other on that.
        normals = np.cross(ways, along)
        between = (normals @ (a - b)) * (normals @ (d - b)) < 0
        targets = b + np.outer(rng.integers(1, 8, 100), along)[between]
        c = b + 8 * along
        yield surface(
            triangle, np.array([[a, b, c], [d, c, b]], dtype=float), targets - 3 * ways[between], targets
        )


def fans() -> Iterator[Surface]:
    """Six triangles around an apex, anywhere, and rays at the apex."""
    rng = np.random.default_rng(3)
    for _ in range(100):
        apex = rng.normal(size=3) * 5
        turns = (np.arange(6) + rng.uniform(0, 0.8, 6)) * np.pi / 3
        ring = apex + np.column_stack((np.cos(turns), np.sin(turns), rng.uniform(-0.3, 0.3, 6)))
        corners = np.stack((np.broadcast_to(apex, ring.shape), ring, np.roll(ring, -1, axis=0)), axis=1)
        origins = apex + [0, 0, 4] + rng.normal(size=(20, 3)) * 0.5
        yield surface(triangle, corners, origins, np.broadcast_to(apex, origins.shape))


def corners_of_rooms() -> Iterator[Surface]:
    """Two walls with a corner and an edge in common, perpendicular as float32 files hold them."""
    rng = np.random.default_rng(4)
    for _ in range(100):
        turned = np.linalg.qr(rng.normal(size=(3, 3)))[0].astype(np.float32).astype(float)
        yield _two_walls(rng, turned)


def skew_corners() -> Iterator[Surface]:
    """The same at any angle."""
    rng = np.random.default_rng(5)
    for _ in range(100):
        yield _two_walls(rng, rng.normal(size=(3, 3)))


def _two_walls(rng: np.random.Generator, edges: Floats) -> Surface:
    corner, (shared, left, right) = rng.normal(size=3), edges
    origins = np.broadcast_to(corner + 0.5 * shared + 0.7 * left + 0.7 * right, (20, 3))
    targets = corner + np.outer(rng.uniform(0.01, 0.99, 20), shared)
    return surface(rectangle, np.array([[corner, shared, left], [corner, shared, right]]), origins, targets)


def sheets_in_whole_numbers() -> Iterator[Surface]:
    """Four parallelograms around a corner, and rays that hit edges and that corner without any rounding."""
    rng = np.random.default_rng(6)
    for _ in range(100):
        corner, first, second = rng.integers(-20, 21, (3, 3)) * 8.0
        around = [corner + i * first + j * second for i, j in itertools.product((0, 1), repeat=2)]
        along = rng.integers(1, 9, 40) / 8
        shares = np.stack((np.ones(40), along), axis=1)
        shares[::2] = shares[::2, ::-1]
        targets, ways = corner + shares @ np.array([first, second]), rng.integers(-160, 161, (40, 3))
        across = ways @ np.cross(first, second) != 0
        parts = np.array([[place, first, second] for place in around])
        yield surface(rectangle, parts, (targets - 3 * ways)[across], targets[across])


def turned_boxes() -> Iterator[Surface]:
    """Boxes of six rectangles by centre, normal and size: their edges agree but for rounding."""
    rng = np.random.default_rng(7)
    for turn in range(40):
        axes = np.linalg.qr(rng.normal(size=(3, 3)))[0].T
        place = np.array(FAR) if turn % 2 else np.zeros(3)
        center, size = place + rng.normal(size=3), rng.uniform(0.5, 3)
        targets = solids.turned_box_edges(center, axes, size, np.append(rng.uniform(-1, 1, 5), [-1, 1]))
        origins = np.broadcast_to(center + rng.uniform(-0.4, 0.4, 3) @ axes * size, targets.shape)
        shapes = solids.turned_box(center, axes, size)
        edges = [edges_of_box_face(shape) for shape in shapes]
        yield Surface(shapes, np.array(edges), origins, targets - origins)


def edges_of_box_face(shape: Json) -> Floats:
    """Corner and edges (3, 3) as the formulas of the scene reference say."""
    width, height = shape["size"]
    first = np.array(shape["tangent"]) * width
    second = np.cross(shape["normal"], shape["tangent"]) * height
    return np.array([np.array(shape["center"]) - first / 2 - second / 2, first, second])


def sphere(place: Sequence[float], kind: str, formula: Formula) -> Outcome:
    """15,000 rays from inside a closed sphere of 960 triangles: at faces, edges and vertices.

    Right is a hit of a triangle that has a vertex in common with the one aimed at.

    Parameters
    ----------
    place : three numbers
        Its centre.
    kind : "mesh" or "triangle"
    formula : Formula
    """
    vertices, faces = solids.globe(place)
    rng = np.random.default_rng(8)
    aimed, targets = _places_on(vertices[faces], rng)
    origins = np.array(place) + rng.uniform(-0.3, 0.3, targets.shape)
    shapes = solids.triangles_of(vertices, faces) if kind == "triangle" else [mesh(vertices, faces)]
    hits = traced(shapes, origins, targets - origins)
    found = hits.shape if kind == "triangle" else np.where(hits.shape < 0, -1, hits.primitive)
    near = (faces[:, None, :, None] == faces[None, :, None, :]).any(axis=(2, 3))
    right = (found >= 0) & near[aimed, found]
    lost = _lost(formula, vertices[faces], near[aimed], origins, targets - origins)
    return Outcome(len(targets), tally(~right), *lost)


def _places_on(corners: Floats, rng: np.random.Generator) -> tuple[Integers, Floats]:
    """Triangles aimed at (N,) and places on them (N, 3): a third inside, on an edge, at a vertex each."""
    aimed = rng.integers(0, len(corners), 15000)
    weights = rng.dirichlet((1, 1, 1), 15000)
    weights[5000:, 2] = 0
    weights[5000:] /= weights[5000:].sum(axis=1, keepdims=True)
    weights[10000:] = [1, 0, 0]
    return aimed, np.asarray((weights[:, :, None] * corners[aimed]).sum(axis=1))


def _lost(formula: Formula, corners: Floats, near: Masks, origins: Floats, directions: Floats) -> list[int]:
    """Rays that a formula lets through: asked about triangles nearby (N, K) first, then about all."""
    rays, triangles = np.nonzero(near)
    parts = list(corners[triangles].transpose(1, 0, 2))
    counts = []
    for number, t in enumerate(formulas.by_dtype(formula, parts, origins[rays], directions[rays])):
        through = np.flatnonzero(np.bincount(rays, weights=np.isfinite(t)) == 0)
        counts.append(tally(~hits_any(formula, corners, origins[through], directions[through])[number]))
    return counts


SHAPES, RAYS = 100, 10

SMALL = 20
"""Coordinates so small that float32 forms products of three of them exactly."""

LARGE = 2**19
"""Coordinates of which float32 holds eighths of sums exactly, and float64 rounds products of three."""


@dataclass(frozen=True, slots=True, eq=False)
class Plane:
    """A corner and two edges of whole numbers, not parallel, each (3,)."""

    corner: Floats
    first: Floats
    second: Floats

    @property
    def normal(self) -> Floats:
        """Not of length 1, exact."""
        return np.cross(self.first, self.second)

    def combined(self, shares: NDArray[Any]) -> Floats:
        """Sums (N, 3) of the edges by shares (N, 2)."""
        return np.asarray(shares @ np.stack((self.first, self.second)))

    def document(self, kind: str) -> Json:
        """As a shape of a scene."""
        parts = [part.tolist() for part in self.triple(kind)]
        return rectangle(*parts) if kind == "rectangle" else triangle(*parts)

    def triple(self, kind: str) -> list[Floats]:
        """What formulas for the kind ask: vertices, or corner and edges."""
        edges = [self.first, self.second]
        return [self.corner, *(edges if kind == "rectangle" else [self.corner + edge for edge in edges])]


def planes(seed: int, reach: int) -> Iterator[tuple[Plane, np.random.Generator]]:
    """Of a family, with coordinates up to `reach`, each with the stream its rays come from."""
    rng = np.random.default_rng(seed)
    made = 0
    while made < SHAPES:
        plane = Plane(*rng.integers(-reach, reach + 1, (3, 3)).astype(float))
        if plane.normal.any():
            made += 1
            yield plane, rng


def along_the_plane(kind: str) -> Outcomes:
    """Rays along the plane, half of them in it. Right is a miss, or in the plane a hit within the shape."""
    return (_along(kind, plane, rng) for plane, rng in planes(1, SMALL))


def _along(kind: str, plane: Plane, rng: np.random.Generator) -> Outcome:
    directions = plane.combined(rng.integers(-9, 10, (RAYS, 2)))
    directions[~directions.any(axis=1)] = plane.first
    beside = rng.choice([-2, -1, 1, 2], RAYS) * (np.arange(RAYS) % 2)
    origins = plane.corner + plane.combined(rng.integers(-9, 10, (RAYS, 2)))
    origins += np.outer(beside, plane.normal)
    low, high = _depths(plane, origins, directions)

    def right(t: Pairs) -> Masks:
        return np.isinf(t) | ((beside == 0) & (low <= t) & (t <= high))

    formula: Formula = formulas.projected_on_edges if kind == "rectangle" else formulas.moeller_trumbore
    textbook = formulas.by_dtype(formula, plane.triple(kind), origins, directions)
    return _outcome(kind, plane, origins, directions, textbook, right)


def _depths(plane: Plane, origins: Floats, directions: Floats) -> tuple[Floats, Floats]:
    """Where the shape begins and ends along rays in its plane, each (N,), a thousandth of it wider."""
    corners = plane.corner + plane.combined(np.array([[0, 0], [1, 0], [0, 1], [1, 1]]))
    depths = ((corners[:, None] - origins) * directions).sum(axis=2) / (directions**2).sum(axis=1)
    low, high = depths.min(axis=0), depths.max(axis=0)
    return low - (high - low) / 1000, high + (high - low) / 1000


def from_the_plane(kind: str) -> Outcomes:
    """Rays that begin on the shape, in eighths of its edges, and go anywhere. Right is a miss."""
    return (_from(kind, plane, rng) for plane, rng in planes(2, LARGE))


def _from(kind: str, plane: Plane, rng: np.random.Generator) -> Outcome:
    shares = rng.integers(0, 9, (RAYS, 2)) / 8
    beyond = shares.sum(axis=1) > 1
    if kind == "triangle":
        shares[beyond] = 1 - shares[beyond]
    origins = plane.corner + plane.combined(shares)
    directions = rng.normal(size=(RAYS, 3))
    textbook = formulas.by_dtype(formulas.normal_form, plane.triple("rectangle"), origins, directions)
    return _outcome(kind, plane, origins, directions, textbook, np.isinf)


def _outcome(
    kind: str,
    plane: Plane,
    origins: Floats,
    directions: Floats,
    textbook: list[Pairs],
    right: Callable[[Pairs], Masks],
) -> Outcome:
    found = traced([plane.document(kind)], origins, directions).t
    return Outcome(RAYS, *(tally(~right(t)) for t in (found, *textbook)))


def tried(family: str, textbook: Textbook) -> Outcomes:
    """A family of rays at flat shapes: hit or miss, t and what comes with it, right but for rounding."""
    return scoring.tried(FLAT[family](), textbook, double=rounded(np.float64), details=flat_details)


PARTS = ("vertices", "corner", "edges")
"""What lengths a flat shape has."""

UNITS = (-40, -13, 7, 40)
"""Powers of two by which a scene is scaled."""


def scaled(family: Iterable[FamilyCase], textbook: Textbook) -> Outcomes:
    """Shapes and rays in other units: wrong is every t that is not the same bit for bit."""
    return (_scaled(document, rays, textbook) for document, rays in family)


def _scaled(document: Json, rays: list[Ray], textbook: Textbook) -> Outcome:
    here, *others = (_distances(document, rays, textbook, power) for power in (0, *UNITS))
    wrong = [sum(tally(there[i] != here[i]) for there in others) for i in range(3)]
    return Outcome(len(rays) * len(UNITS), *wrong)


def _distances(document: Json, rays: list[Ray], textbook: Textbook, power: int) -> list[Pairs]:
    """Distances (N,) by the renderer, and by a formula in float64 and float32, all times a power of two."""
    shape = document | {part: np.ldexp(document[part], power).tolist() for part in PARTS if part in document}
    origins, directions = np.ldexp(np.array(rays).transpose(1, 0, 2), power)
    read = read_scene(scene(shape))[0].shapes[0]
    plain = in_both(lambda dtype: textbook(read, origins.astype(dtype), directions.astype(dtype)))
    return [traced([shape], origins, directions).t, *plain]
