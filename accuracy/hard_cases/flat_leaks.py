"""Surfaces of triangles or rectangles that share edges, and rays that pass between two of them."""

import itertools
from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np

import renderer
from accuracy.hard_cases import solids
from accuracy.hard_cases.cases import Outcome, total
from accuracy.hard_cases.documents import Json, rectangle, scene, triangle
from accuracy.hard_cases.flat_formulas import Formula
from renderer.math.arrays import Floats, Integers, Masks

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


def leaks(surfaces: Iterator[Surface], formula: Formula) -> Outcome:
    """Rays that the renderer, and a formula in both precisions, let through."""
    return total(_leaks_of(surface, formula) for surface in surfaces)


def _leaks_of(surface: Surface, formula: Formula) -> Outcome:
    hits = renderer.trace(
        renderer.compile_scene(renderer.load_scene(scene(*surface.shapes))),
        surface.origins,
        surface.directions,
    )
    lost = [
        np.count_nonzero(~met_any(formula, surface.parts, surface.origins, surface.directions, dtype))
        for dtype in (np.float64, np.float32)
    ]
    return Outcome(len(hits.t), int(np.count_nonzero(hits.shape < 0)), int(lost[0]), int(lost[1]))


def met_any(
    formula: Formula, parts: Floats, origins: Floats, directions: Floats, dtype: type[np.floating]
) -> Masks:
    """Whether a formula finds rays (N, 3) to hit any of some shapes (K, 3, 3), (N,)."""
    vectors = [part.astype(dtype)[None] for part in parts.transpose(1, 0, 2)]
    with np.errstate(all="ignore"):
        t = formula(vectors, origins.astype(dtype)[:, None], directions.astype(dtype)[:, None])
    return np.asarray(np.isfinite(t).any(axis=1))


def of_triangles(corners: Floats, origins: Floats, targets: Floats) -> Surface:
    """Triangles (K, 3, 3) and rays from origins through targets."""
    shapes = [triangle(*rows) for rows in corners.tolist()]
    return Surface(shapes, corners, origins, targets - origins)


def of_rectangles(parts: Floats, origins: Floats, targets: Floats) -> Surface:
    """Rectangles by corner and edges (K, 3, 3), and rays from origins through targets."""
    shapes = [rectangle(*rows) for rows in parts.tolist()]
    return Surface(shapes, parts, origins, targets - origins)


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
        yield of_triangles(np.array([[a, b, c], [d, c, b]]), origins, targets)


def pairs_in_whole_numbers() -> Iterator[Surface]:
    """The same in whole numbers, with rays that meet the edge without any rounding."""
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
        yield of_triangles(
            np.array([[a, b, c], [d, c, b]], dtype=float), targets - 3 * ways[between], targets
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
        yield of_triangles(corners, origins, np.broadcast_to(apex, origins.shape))


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
    return of_rectangles(np.array([[corner, shared, left], [corner, shared, right]]), origins, targets)


def sheets_in_whole_numbers() -> Iterator[Surface]:
    """Four parallelograms around a corner, and rays that meet edges and that corner without any rounding."""
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
        yield of_rectangles(parts, (targets - 3 * ways)[across], targets[across])


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
    shapes = solids.triangles_of(vertices, faces) if kind == "triangle" else [solids.mesh(vertices, faces)]
    plan = renderer.compile_scene(renderer.load_scene(scene(*shapes)))
    hits = renderer.trace(plan, origins, targets - origins)
    found = hits.shape if kind == "triangle" else np.where(hits.shape < 0, -1, hits.primitive)
    near = (faces[:, None, :, None] == faces[None, :, None, :]).any(axis=(2, 3))
    right = (found >= 0) & near[aimed, found]
    lost = [
        _lost(formula, vertices[faces], near, aimed, origins, targets - origins, dtype)
        for dtype in (np.float64, np.float32)
    ]
    return Outcome(len(targets), int(np.count_nonzero(~right)), *lost)


def _places_on(corners: Floats, rng: np.random.Generator) -> tuple[Integers, Floats]:
    """Triangles aimed at (N,) and places on them (N, 3): a third inside, on an edge, at a vertex each."""
    aimed = rng.integers(0, len(corners), 15000)
    weights = rng.dirichlet((1, 1, 1), 15000)
    weights[5000:, 2] = 0
    weights[5000:] /= weights[5000:].sum(axis=1, keepdims=True)
    weights[10000:] = [1, 0, 0]
    return aimed, np.asarray((weights[:, :, None] * corners[aimed]).sum(axis=1))


def _lost(
    formula: Formula,
    corners: Floats,
    near: Masks,
    aimed: Integers,
    origins: Floats,
    directions: Floats,
    dtype: type[np.floating],
) -> int:
    """Rays that a formula lets through: asked about triangles nearby first, then about all."""
    numbers = [np.flatnonzero(row) for row in near]
    counts = np.array([len(row) for row in numbers])[aimed]
    triangles = np.concatenate([numbers[number] for number in aimed])
    rays = np.repeat(np.arange(len(aimed)), counts)
    parts = [part.astype(dtype)[triangles] for part in corners.transpose(1, 0, 2)]
    with np.errstate(all="ignore"):
        t = formula(parts, origins.astype(dtype)[rays], directions.astype(dtype)[rays])
    through = np.flatnonzero(np.bincount(rays, weights=np.isfinite(t)) == 0)
    met = met_any(formula, corners, origins[through], directions[through], dtype)
    return int(np.count_nonzero(~met))
