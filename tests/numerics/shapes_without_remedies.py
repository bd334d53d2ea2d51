"""Scene files, cameras, shapes and trees without their remedies: textbook formulas, or no guard.

Each function or method has the signature of what it stands for.
"""

import json
from collections.abc import Callable
from dataclasses import fields
from types import SimpleNamespace
from typing import Any

import numpy as np

from accuracy.hard_cases import formulas
from renderer.accelerators.bvh import NOTHING, Level
from renderer.cameras import Pinhole, build_pinhole
from renderer.interaction import Points, Rays
from renderer.math.arrays import Floats, dot, unit
from renderer.math.numerics import gamma
from renderer.shapes import ellipsoids, woop
from renderer.shapes.ellipsoids import Ellipsoids
from renderer.shapes.family import WHOLE
from renderer.shapes.rectangles import Rectangles
from renderer.shapes.triangles import Triangles
from schemas.cameras import Camera


def unchecked(source: dict[str, Any] | bytes) -> Any:
    """A scene file as the standard parser reads it: with NaN, infinities, and anything in any field."""
    return json.loads(source) if isinstance(source, bytes) else source


def plain_unit(v: Floats) -> Floats:
    """Vectors over the root of the sum of their squares."""
    with np.errstate(all="ignore"):
        return v / np.sqrt(dot(v, v))


def once_perpendicular(look: Floats, up: Floats) -> tuple[Floats, Floats, Floats]:
    forward = unit(look)
    right = unit(np.cross(forward, unit(up), axis=0))
    return right, unit(np.cross(right, forward, axis=0)), forward


def plain_screen(view: Any, x: Floats, y: Floats) -> tuple[Floats, Floats]:
    return view.half_width * (2 * x / view.width - 1), view.half_height * (1 - 2 * y / view.height)


def in_single(view: Any, x: Floats, y: Floats) -> Floats:
    across, along = view.screen(x, y)
    return (view.forward + view.right * across + view.up * along).astype(np.float32).astype(np.float64)


def between_places(view: Any, x: Floats, y: Floats) -> Floats:
    across, along = view.screen(x, y)
    return (view.position + view.forward + view.right * across + view.up * along) - view.position


BUILD = build_pinhole


def at_the_focal_length(camera: Camera) -> Pinhole:
    """A camera whose rays pass through points of the virtual screen."""

    class Screen(Pinhole):
        def directions(self, x: Floats, y: Floats) -> Floats:
            return formulas.through_the_screen(self, x, y, np.float64, camera.focal_length)

    view = BUILD(camera)
    return Screen(**{item.name: getattr(view, item.name) for item in fields(view)})


WATERTIGHT = woop.hits


def wide(roundings: int) -> float:
    """A bound that adds up all that could go wrong with a sliver."""
    return 2e9 * gamma(roundings)


def hits_by(limit: float) -> Callable[..., woop.PairHits]:
    """The test of Moeller and Trumbore in the place of Woop's."""

    def hits(vertices: Floats, origins: Floats, directions: Floats, start: Any = None) -> woop.PairHits:
        del start
        places = [vertex.T for vertex in np.broadcast_to(vertices, (3, *directions.shape))]
        begins = np.broadcast_to(origins, directions.shape).T
        with np.errstate(all="ignore"):
            t, u, v, determinant = formulas.solved(places, begins, directions.T)
        inside = (np.abs(determinant) >= limit) & (u >= 0) & (v >= 0) & (u + v <= 1) & (t > 0)
        found = np.flatnonzero(inside)
        return woop.PairHits(found, t[found], u[found], v[found])

    return hits


def hits_or_nan(vertices: Floats, origins: Floats, directions: Floats, start: Any = None) -> woop.PairHits:
    """The same, where 0/0 is no miss."""
    del start
    places = [vertex.T for vertex in np.broadcast_to(vertices, (3, *directions.shape))]
    begins = np.broadcast_to(origins, directions.shape).T
    with np.errstate(all="ignore"):
        t = formulas.moeller_trumbore(places, begins, directions.T)
    found = np.flatnonzero(~np.isinf(t))
    return woop.PairHits(found, t[found], t[found], t[found])


def hits_in_single(vertices: Floats, origins: Floats, directions: Floats, start: Any = None) -> woop.PairHits:
    rounded = (part.astype(np.float32).astype(np.float64) for part in (vertices, origins, directions))
    return WATERTIGHT(*rounded, start)


def hits_in_fused_arithmetic(x: list[Any], y: list[Any]) -> list[Any]:
    """Edge functions of which one product is not rounded."""
    pairs = ((2, 1), (0, 2), (1, 0))
    return [(x[i].astype(np.longdouble) * y[j] - y[i] * x[j]).astype(np.float64) for i, j in pairs]


SHEARED = woop._sheared  # noqa: SLF001 - the one place where edge functions are formed


def fused_sheared(*arguments: Any) -> Any:
    pairs = SHEARED(*arguments)
    weights = hits_in_fused_arithmetic(pairs.x, pairs.y)
    return woop._Sheared(pairs.x, pairs.y, pairs.depths, weights, pairs.along)  # noqa: SLF001


LOCATE = Triangles.locate


def along_the_ray(family: Triangles, points: Points, chosen: Any, shapes: Any) -> None:
    LOCATE(family, points, chosen, shapes)
    origins = np.broadcast_to(points.origins, points.directions.shape)
    points.positions[:, chosen] = (origins + points.t * points.directions)[:, chosen]


def not_turned(family: Triangles, points: Points, chosen: Any, shapes: Any) -> None:
    """Normals on the outward side, wherever the ray came from."""
    LOCATE(family, points, chosen, shapes)
    points.normals[:, chosen] = points.shading_normals[:, chosen] = family.normals[:, shapes]


def projected(limit: float) -> Callable[[Rectangles, int, Rays], None]:
    """A rectangle's hits by projection on its edges."""

    def intersect(family: Rectangles, shape: int, rays: Rays) -> None:
        parts = [part[:, shape] for part in (family.anchors, family.first, family.second)]
        begins = np.broadcast_to(rays.origins, rays.directions.shape).T
        with np.errstate(all="ignore"):
            t = formulas.projected_on_edges(parts, begins, rays.directions.T, limit)
        found = np.flatnonzero(np.isfinite(t))
        places = begins[found] + t[found, None] * rays.directions.T[found] - parts[0]
        u, v = (places @ edge / (edge @ edge) for edge in parts[1:])
        rays.offer(found, t[found], (u, v), family.numbers[shape : shape + 1], WHOLE)

    return intersect


def projected_or_nan(family: Rectangles, shape: int, rays: Rays) -> None:
    """The same, where 0/0 is no miss."""
    parts = [part[:, shape] for part in (family.anchors, family.first, family.second)]
    begins = np.broadcast_to(rays.origins, rays.directions.shape).T
    with np.errstate(all="ignore"):
        t = formulas.projected_on_edges(parts, begins, rays.directions.T)
    found = np.flatnonzero(~np.isinf(t))
    rays.offer(found, t[found], (t[found], t[found]), family.numbers[shape : shape + 1], WHOLE)


def taken_unless_farther(rays: Rays, candidates: Any, t: Floats, *what: Any) -> None:
    """Hits that are not known to be farther: a comparison with NaN is false."""
    nearer = ~(t >= rays.t[candidates])
    rays.t[candidates[nearer]] = t[nearer]
    rays.shapes[candidates[nearer]] = np.broadcast_to(what[1], t.shape)[nearer]


OFFER = Rays.offer


def first_come(rays: Rays, candidates: Any, t: Floats, *what: Any) -> None:
    """Of equal hits the first that was found."""
    coordinates, *numbers = what
    new = t < rays.t[candidates]
    places = tuple(part[new] for part in coordinates)
    OFFER(rays, candidates[new], t[new], places, *(np.broadcast_to(each, t.shape)[new] for each in numbers))


def roots_by(formula: Callable[..., Any], dtype: Any = np.float64) -> Callable[[Ellipsoids, int, Rays], None]:
    """An ellipsoid's hits by a textbook's formula."""

    def intersect(family: Ellipsoids, shape: int, rays: Rays) -> None:
        one = SimpleNamespace(center=family.centers[:, shape], axes=family.axes[:, :, shape])
        begins = np.broadcast_to(rays.origins, rays.directions.shape).T
        with np.errstate(all="ignore"):
            t = formula(one, begins.astype(dtype), rays.directions.T.astype(dtype))
        found = np.flatnonzero(np.isfinite(t))
        t = t[found].astype(np.float64)
        places = (begins[found] + t[:, None] * rays.directions.T[found]).T - family.centers[:, [shape]]
        where = unit(family.to_sphere(places, shape))
        angles = ellipsoids._angles(where)  # noqa: SLF001
        rays.offer(found, t, angles, family.numbers[shape : shape + 1], WHOLE)

    return intersect


def quadratic(dtype: Any) -> Callable[[Ellipsoids, int, Rays], None]:
    """An ellipsoid's hits by b^2 - 4ac, after one matrix that also moves."""
    return roots_by(formulas.quadratic, dtype)


LOCATE_ROUND = Ellipsoids.locate


def normals_by_the_axes(family: Ellipsoids, points: Points, chosen: Any, shapes: Any) -> None:
    LOCATE_ROUND(family, points, chosen, shapes)
    relative = points.positions[:, chosen] - family.centers[:, shapes]
    where = np.stack([dot(relative, row) for row in family.inverse[:, :, shapes]])
    normals = unit((where[:, None] * family.axes[:, :, shapes]).sum(axis=0))
    points.normals[:, chosen] = normals * np.where(points.flipped[chosen], -1.0, 1.0)


def by_arc_cosine(where: Floats) -> tuple[Floats, Floats]:
    x, y, z = where
    with np.errstate(invalid="ignore"):
        return np.arctan2(y, x) / (2 * np.pi) % 1, np.arccos(-z * (1 + 2.0**-52)) / np.pi


def free_to_leave(family: Any, shape: int, start: Any, found: Any, power: Floats) -> Any:
    del family, shape, start
    return power, np.ones(found.size, dtype=bool)


def bare_slabs(level: Level, nodes: Any, origins: Floats, inverse: Floats) -> tuple[Floats, Floats]:
    """The test of boxes as they are, by minimum and maximum, which hand a NaN on."""
    near, far = np.zeros((level.children, nodes.size)), np.full((level.children, nodes.size), np.inf)
    for axis, sides in enumerate(level.sides):
        low, high = (np.take(sides, nodes + upper * level.nodes, axis=1) for upper in (0, 1))
        first = (np.nextafter(low, np.inf) - origins[axis]) * inverse[axis]
        second = (np.nextafter(high, -np.inf) - origins[axis]) * inverse[axis]
        near = np.maximum(near, np.minimum(first, second))
        far = np.minimum(far, np.maximum(first, second))
    return near, far


def shared_out_by_place(centers: Floats, splits: int, width: int) -> Any:
    """As many leaves as a tree by number has, each a part of equal width of the box of all places."""
    low, extent = centers.min(axis=1, keepdims=True), np.ptp(centers, axis=1, keepdims=True)
    along = np.argmax(extent)
    leaves = ((centers - low) / extent * ((1 << splits) - 1)).astype(np.int64)[along]
    order = np.full((1 << splits, width), NOTHING)
    for leaf in range(1 << splits):
        held = np.flatnonzero(leaves == leaf)
        order[leaf, : held.size] = held
    return order.reshape(-1)
