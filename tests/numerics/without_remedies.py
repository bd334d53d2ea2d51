"""The renderer's code without its remedies: textbook formulas, or the same code without a guard.

Each function or method has the signature of what it stands for.
"""

from collections.abc import Callable
from types import SimpleNamespace
from typing import Any

import numpy as np

from accuracy.hard_cases import formulas
from renderer.images.colors import srgb_from_linear
from renderer.interaction import Points, Rays
from renderer.math.arrays import Floats, Masks, dot, unit
from renderer.math.numerics import gamma
from renderer.samplers import PATTERNS
from renderer.shapes import ellipsoids, woop
from renderer.shapes.borders import Lift
from renderer.shapes.ellipsoids import Ellipsoids
from renderer.shapes.family import WHOLE
from renderer.shapes.rectangles import Rectangles
from renderer.shapes.triangles import Triangles


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


def quadratic(dtype: Any) -> Callable[[Ellipsoids, int, Rays], None]:
    """An ellipsoid's hits by b^2 - 4ac, after one matrix that also moves."""

    def intersect(family: Ellipsoids, shape: int, rays: Rays) -> None:
        one = SimpleNamespace(center=family.centers[:, shape], axes=family.axes[:, :, shape])
        begins = np.broadcast_to(rays.origins, rays.directions.shape).T
        with np.errstate(all="ignore"):
            t = formulas.quadratic(one, begins.astype(dtype), rays.directions.T.astype(dtype))
        found = np.flatnonzero(np.isfinite(t))
        t = t[found].astype(np.float64)
        places = (begins[found] + t[:, None] * rays.directions.T[found]).T - family.centers[:, [shape]]
        where = unit(family.to_sphere(places, shape))
        angles = ellipsoids._angles(where)  # noqa: SLF001
        rays.offer(found, t, angles, family.numbers[shape : shape + 1], WHOLE)

    return intersect


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


def plain_powers(cosines: Any, exponents: Floats) -> None:
    """With 0 ** 0 = 1."""
    np.power(np.maximum(cosines, 0), exponents.astype(cosines.dtype), out=cosines)


def powers_of_any_sign(cosines: Any, exponents: Floats) -> None:
    with np.errstate(invalid="ignore"):
        np.power(cosines, exponents.astype(cosines.dtype), out=cosines)


def cosines_of_any_sign(view: Any, vectors: Floats, out: Any) -> Any:
    view.light_points.affine(view.terms(vectors), out, view.workspace)
    return np.multiply(out, view.inverse_distances(), out=out)


def left_black(points: Any, away: Any) -> Floats:
    return -points.shading_normals[:, away]


def four_weights(texture: Any, x: Floats, y: Floats) -> Floats:
    """The sum of four texels by their weights."""
    i, j = np.floor(x).astype(np.int64), np.floor(y).astype(np.int64)
    u, v = x - i, y - j
    weights = {(0, 0): (1 - u) * (1 - v), (0, 1): u * (1 - v), (1, 0): (1 - u) * v, (1, 1): u * v}
    return sum(weight * texture._fetch(j + b, i + a) for (b, a), weight in weights.items())  # noqa: SLF001


def without_reduction(texture: Any, coordinate: Floats, size: int) -> Floats:
    del texture
    return coordinate.astype(np.float32).astype(np.float64) * size


def no_footprints(stage: Any, points: Points) -> None:
    del stage
    points.footprints = np.zeros((2, 2, points.t.size))


def unwelded(part: Any, patch: Any) -> Lift:
    """Every vertex moves by its own normal and height."""
    return Lift(
        places=patch.positions,
        owner=np.arange(patch.positions.shape[1]),
        normals=unit(patch.normals),
        heights=part.heights.at(patch.coordinates),
        border=patch.border,
    )


def plain_transmitted_cosine(cosine: Floats, ratio: Floats) -> Floats:
    with np.errstate(invalid="ignore"):
        return np.sqrt(1 - ratio * ratio * (1 - cosine * cosine))


def not_wrapped(key: Any, index: Any, count: int) -> tuple[Floats, Floats]:
    a, b = (part - 0.5 for part in PATTERNS["uniform"](key, index, count))
    return (2 * a - b) / np.sqrt(5.0) + 0.5, (a + 2 * b) / np.sqrt(5.0) + 0.5


def shrunk(key: Any, index: Any, count: int) -> tuple[Floats, Floats]:
    """The turned grid made small enough for the pixel."""
    a, b = (part - 0.5 for part in not_wrapped(key, index, count))
    return a * np.sqrt(5.0) / 3 + 0.5, b * np.sqrt(5.0) / 3 + 0.5


def in_turn(seed: int) -> Callable[..., Any]:
    """Random bits from one generator, in the order of the questions."""
    rng = np.random.default_rng(seed)

    def bits(key: Any, counter: Any) -> Any:
        shape = np.broadcast_shapes(np.shape(key), np.shape(counter))
        return rng.integers(0, 2**32, shape, dtype=np.uint32)

    return bits


def summed_in_order(terms: Any) -> Any:
    return np.cumsum(terms.astype(np.float32), axis=0)[-1].astype(np.float64)


def plain_spread(part: Any, columns: Any, rows: Any, radiance: Floats) -> None:
    """The mean of the squares less the square of the mean."""
    samples = radiance.reshape(3, columns.size, -1)
    mean, count = samples.mean(axis=2), samples.shape[2]
    part.record[0:3, rows, columns] = mean
    part.record[3:6, rows, columns] = count * ((samples * samples).mean(axis=2) - mean * mean)


def shown(*, clipped: bool, rounded: bool) -> Callable[..., Any]:
    """Codes without the guard against numbers that are no brightness, or without rounding."""

    def displayed(image: Any, display: Any) -> Any:
        with np.errstate(all="ignore"):
            exposed = image.astype(np.float64) * 2.0**display.exposure
            values = np.clip(exposed, 0.0, 1.0) if clipped else exposed
            encoded = srgb_from_linear(values) if display.transfer == "srgb" else values
            return np.floor(encoded * 255 + (0.5 if rounded else 0.0)).astype(np.uint8)

    return displayed


def trusted(distances: Floats, bounds: Floats, sides: Floats, own: Masks) -> Floats:
    """Signed distances as they were computed, 0 on a point's own surface."""
    del bounds, sides
    return np.where(own, 0.0, distances)
