"""Formulas as textbooks have them, to count what they get wrong: cameras, hits and glass."""

from collections.abc import Callable, Sequence
from typing import Any

import mpmath
import numpy as np

from accuracy.hard_cases.harness import exact, in_both
from renderer.cameras import Pinhole, ThinLens
from renderer.math.arrays import Floats, Integers, Masks, Pairs, dot

Triple = Sequence[Pairs]
"""Three vertices, or a corner and two edges."""
Formula = Callable[[Triple, Pairs, Pairs], Pairs]
"""A shape, origins and directions, to distances."""

SMALL = 1e-6
"""What counts as parallel in the code of Moeller and Trumbore (1997), and in many books after it."""


def textbook_bases(looks: Floats, ups: Floats) -> Floats:
    """Bases (N, 3, 3) of views (N, 3) by two products, each vector divided by the root of its square."""
    forward = _plain_unit(looks)
    right = _plain_unit(np.cross(forward, ups))
    return np.stack((right, np.cross(right, forward), forward), axis=1).astype(np.float64)


def _plain_unit(v: Floats) -> Floats:
    return v / np.sqrt((v * v).sum(axis=1, keepdims=True))


def plain_places(size: int, side: Any, dtype: Any) -> Floats:
    """Pixel centres from -side to side, as a share of the screen less 1."""
    x = np.arange(size, dtype=dtype) + dtype(0.5)
    return dtype(side) * (2 * x / dtype(size) - 1)


def plain_disk(x: Floats, y: Floats) -> tuple[Floats, Floats]:
    """The map as published, (N,) and (N,)."""
    wide = np.abs(x) > np.abs(y)
    radius = np.where(wide, x, y)
    quarter = x.dtype.type(np.pi / 4)
    turn = np.where(wide, quarter * (y / x), 2 * quarter - quarter * (x / y))
    return radius * np.cos(turn), radius * np.sin(turn)


def through_the_screen(view: Pinhole, x: Floats, y: Floats, dtype: Any, focal_length: float = 1.0) -> Floats:
    """Directions (3, N) of length 1 from the camera to points of a screen at the focal length."""
    position, right, up, forward = (
        v.astype(dtype) for v in (view.position, view.right, view.up, view.forward)
    )
    across = dtype(view.half_width) * (2 * x.astype(dtype) / view.width - 1)
    along = dtype(view.half_height) * (1 - 2 * y.astype(dtype) / view.height)
    away = position + dtype(focal_length) * (forward + right * across + up * along) - position
    return away / np.sqrt(dot(away, away))


def between_points(view: Pinhole, x: Floats, y: Floats, dtype: Any) -> Floats:
    """Directions (3, N) from places on the lens to points in focus, as differences of points."""
    assert isinstance(view, ThinLens)
    position, pixels = view.position.astype(dtype), np.arange(x.size)
    origins = view.rays(x, y, pixels, pixels % 16)[0].astype(dtype)
    focus = dtype(view.focus)
    return (position + focus * view.directions(x, y).astype(dtype) - origins) / focus


def moeller_trumbore(vertices: Triple, origins: Pairs, directions: Pairs, limit: float = 0.0) -> Pairs:
    """Moeller and Trumbore (1997); determinants below `limit` are parallel."""
    t, u, v, determinant = solved(vertices, origins, directions)
    return _without(t, (np.abs(determinant) < limit) | (u < 0) | (u > 1) | (v < 0) | (u + v > 1))


def plain_weights(vertices: Triple, origins: Pairs, directions: Pairs) -> Pairs:
    """The sum of the weights of the second and third vertex, by the same formula."""
    _, u, v, _ = solved(vertices, origins, directions)
    return u + v


def solved(vertices: Triple, origins: Pairs, directions: Pairs) -> tuple[Pairs, Pairs, Pairs, Pairs]:
    """Distance, weights of the second and third vertex, and the determinant that divides them."""
    a, b, c = vertices
    first, second, away = b - a, c - a, origins - a
    across = np.cross(directions, second)
    determinant = _dot(first, across)
    beside = np.cross(away, first)
    u, v = _dot(away, across) / determinant, _dot(directions, beside) / determinant
    return _dot(second, beside) / determinant, u, v, determinant


def plane_and_sides(vertices: Triple, origins: Pairs, directions: Pairs) -> Pairs:
    """The place where the ray hits the plane, and whether it lies on the inner side of each edge."""
    a, b, c = vertices
    normal = np.cross(b - a, c - a)
    t = _dot(a - origins, normal) / _dot(directions, normal)
    places = origins + t[..., None] * directions
    missed = np.zeros(t.shape, dtype=bool)
    for start, end in ((a, b), (b, c), (c, a)):
        missed |= _dot(np.cross(end - start, places - start), normal) < 0
    return _without(t, missed)


def woop(vertices: Triple, origins: Pairs, directions: Pairs, *, bounded: bool = False) -> Pairs:
    """Woop, Benthin and Wald (2013); `bounded` drops hits nearer than the error of t, as pbrt-v4 does."""
    order = (np.argmax(np.abs(directions), axis=-1)[..., None] + [1, 2, 0]) % 3
    length = np.sqrt(_dot(directions, directions))
    along = np.take_along_axis(directions / length[..., None], order, axis=-1)
    places = [np.take_along_axis(vertex - origins, order, axis=-1) for vertex in vertices]
    x, y = (
        np.stack([place[..., k] - along[..., k] / along[..., 2] * place[..., 2] for place in places])
        for k in (0, 1)
    )
    depths = np.stack([place[..., 2] / along[..., 2] for place in places])
    weights = np.stack([x[1] * y[2] - y[1] * x[2], x[2] * y[0] - y[2] * x[0], x[0] * y[1] - y[0] * x[1]])
    total = weights.sum(axis=0)
    t = (weights * depths).sum(axis=0) / total
    missed = (weights < 0).any(axis=0) & (weights > 0).any(axis=0)
    if bounded:
        bound = _bound_of_t(*(np.abs(part).max(axis=0) for part in (x, y, depths, weights)))
        missed |= t <= bound / np.abs(total)
    return _without(t / length, missed | (total == 0))


def _bound_of_t(x: Pairs, y: Pairs, depth: Pairs, weight: Pairs) -> Pairs:
    """As in `Triangle::Intersect` of pbrt-v4, times the sum of the weights."""
    unit = np.finfo(x.dtype).eps / 2
    three, five, two = (n * unit / (1 - n * unit) for n in (3, 5, 2))
    of_x, of_y, of_depth = five * (x + depth), five * (y + depth), three * depth
    of_weight = 2 * (two * x * y + of_y * x + of_x * y)
    return 3 * (three * weight * depth + of_weight * depth + of_depth * weight)


def projected_on_edges(edges: Triple, origins: Pairs, directions: Pairs, limit: float = 0.0) -> Pairs:
    """The place where the ray hits the plane, projected on two edges that are taken for perpendicular."""
    corner, first, second = edges
    normal = np.cross(first, second)
    slope = _dot(directions, normal)
    t = _dot(corner - origins, normal) / slope
    away = origins + t[..., None] * directions - corner
    u, v = _dot(away, first) / _dot(first, first), _dot(away, second) / _dot(second, second)
    return _without(t, (np.abs(slope) < limit) | (u < 0) | (u > 1) | (v < 0) | (v > 1))


def closed_parallelogram(edges: Triple, origins: Pairs, directions: Pairs) -> Pairs:
    """By triple products, with a border that is as wide as its numbers say and no wider."""
    corner, first, second = edges
    normal, away = np.cross(first, second), origins - corner
    slope, moment = _dot(directions, normal), np.cross(away, directions)
    u, v = -_dot(moment, second) / slope, _dot(moment, first) / slope
    return _without(-_dot(away, normal) / slope, (u < 0) | (u > 1) | (v < 0) | (v > 1))


def normal_form(edges: Triple, origins: Pairs, directions: Pairs) -> Pairs:
    """Where a ray hits the plane n . x = k of unit normal n."""
    corner, first, second = edges
    product = np.cross(first, second)
    normal = product / np.sqrt(_dot(product, product))[..., None]
    t = (_dot(normal, corner) - _dot(normal, origins)) / _dot(normal, directions)
    return _without(t, np.zeros(t.shape, dtype=bool))


def _dot(a: Pairs, b: Pairs) -> Pairs:
    return a[..., 0] * b[..., 0] + a[..., 1] * b[..., 1] + a[..., 2] * b[..., 2]


def _without(t: Pairs, missed: Masks) -> Pairs:
    # A comparison with NaN is false: as in the books, 0/0 is not sorted out.
    return np.where(missed | (t <= 0), np.inf, t)


def by_dtype(formula: Formula, parts: Triple, origins: Floats, directions: Floats) -> list[Pairs]:
    """Distances by a formula in float64 and in float32."""

    def asked(dtype: type[np.floating]) -> Pairs:
        rounded = [part.astype(dtype) for part in parts]
        return formula(rounded, origins.astype(dtype), directions.astype(dtype))

    return in_both(asked)


def of_shape(formula: Callable[..., Pairs], **limit: float) -> Callable[[Any, Pairs, Pairs], Pairs]:
    """A formula for shapes of a scene: a triangle or rectangle, origins, directions, to distances (N,)."""

    def asked(shape: Any, origins: Pairs, directions: Pairs) -> Pairs:
        return formula(list(parts_of(shape).astype(origins.dtype)), origins, directions, **limit)

    return asked


def parts_of(shape: Any) -> Floats:
    """Vertices of a triangle of a scene, or corner and edges of a rectangle, (3, 3)."""
    return np.array(shape.vertices if shape.type == "triangle" else (shape.corner, *shape.edges))


triangle, triangle_with_limit = of_shape(moeller_trumbore), of_shape(moeller_trumbore, limit=SMALL)
rectangle, rectangle_with_limit = of_shape(projected_on_edges), of_shape(projected_on_edges, limit=SMALL)


def quadratic(shape: Any, origins: Pairs, directions: Pairs) -> Pairs:
    """Distances (N,) of rays (N, 3): b^2 - 4ac of the ray brought to the unit sphere by one 4x4 matrix.

    inf for a miss.
    """
    roots, missed = _roots(shape, origins, directions)
    return _nearest(roots, missed)


def boxed_quadratic(shape: Any, origins: Pairs, directions: Pairs) -> Pairs:
    """The same, after a test of the box that takes a component of -0 for one of 0 (Smits 1998)."""
    middle, axes = _parts(shape, origins.dtype)
    reach = np.sqrt((axes * axes).sum(axis=0))
    first, second = (middle - reach - origins) / directions, (middle + reach - origins) / directions
    forward = directions >= 0
    near, far = np.where(forward, first, second).max(axis=1), np.where(forward, second, first).min(axis=1)
    return np.where(near > far, np.inf, quadratic(shape, origins, directions))


def _parts(shape: Any, dtype: np.dtype[Any]) -> tuple[Pairs, Pairs]:
    """Centre (3,) and semi-axes, one a row."""
    axes = shape.axes if hasattr(shape, "axes") else np.eye(3) * shape.radius
    return np.array(shape.center, dtype=dtype), np.array(axes, dtype=dtype)


def _inverse(axes: Pairs) -> Pairs:
    return axes / (axes * axes).sum(axis=1)[:, None]


def _roots(shape: Any, origins: Pairs, directions: Pairs) -> tuple[tuple[Pairs, Pairs], Masks]:
    middle, axes = _parts(shape, origins.dtype)
    rows = _inverse(axes)
    o, d = origins @ rows.T - rows @ middle, directions @ rows.T
    a, b, c = (d * d).sum(axis=1), 2 * (o * d).sum(axis=1), (o * o).sum(axis=1) - 1
    root = np.sqrt(b * b - 4 * a * c)
    return ((-b - root) / (2 * a), (-b + root) / (2 * a)), b * b - 4 * a * c < 0


def _nearest(roots: tuple[Pairs, Pairs], missed: Masks) -> Pairs:
    first, second = roots
    t = np.where(first > 0, first, second)
    return np.where(missed | (t <= 0), np.inf, t)


def plain_inner_cosine(cosine: Pairs, ratio: Pairs) -> Pairs:
    """Snell's law as textbooks write it: the cosine of the refracted angle, without any clamp."""
    one = cosine.dtype.type(1)
    return np.sqrt(one - ratio * ratio * (one - cosine * cosine))


def plain_fresnel(cosine: Pairs, ratio: Pairs) -> Pairs:
    """Fresnel's formulas on that cosine."""
    inner = plain_inner_cosine(cosine, ratio)
    across = (ratio * cosine - inner) / (ratio * cosine + inner)
    along = (cosine - ratio * inner) / (cosine + ratio * inner)
    return (across * across + along * along) / 2


@exact
def true_fresnel(cosine: float, ratio: float) -> float:
    """The reflected share in 50 digits, rounded once."""
    c, n = mpmath.mpf(cosine), mpmath.mpf(ratio)
    square = 1 - n * n * (1 - c * c)
    if square <= 0:
        return 1.0
    inner = mpmath.sqrt(square)
    across, along = (n * c - inner) / (n * c + inner), (c - n * inner) / (c + n * inner)
    return float((across**2 + along**2) / 2)


def plain_hits(center: Pairs, radius: float, origins: Pairs, directions: Pairs, dtype: Any) -> Integers:
    """How often refracted rays (3, N) hit a sphere, if each starts where `t > 1e-4`, (N,)."""
    center, origins, directions = (part.astype(dtype) for part in (center, origins, directions))
    radius = dtype(radius)
    counts = np.zeros(directions.shape[1], dtype=np.int64)
    alive = np.ones(counts.size, dtype=bool)
    for _ in range(4):
        b = (directions * (origins - center)).sum(axis=0)
        c = ((origins - center) ** 2).sum(axis=0) - radius * radius
        root = np.sqrt(b * b - c)
        ahead = [np.where(t > dtype(1e-4), t, dtype(np.inf)) for t in (-b - root, -b + root)]
        t = np.minimum(*ahead)
        alive &= np.isfinite(t)
        counts += alive
        origins = np.where(alive, origins + t * directions, origins)
        normals = (origins - center) / radius
        directions = np.where(alive, _plainly_bent(directions, normals), directions)
    return counts


def _plainly_bent(directions: Pairs, normals: Pairs) -> Pairs:
    along = (directions * normals).sum(axis=0)
    outwards = along > 0
    facing = np.where(outwards, -normals, normals)
    ratio = np.where(outwards, along.dtype.type(1.5), along.dtype.type(1 / 1.5))
    cosine = np.abs(along)
    bent = ratio * directions + (ratio * cosine - plain_inner_cosine(cosine, ratio)) * facing
    return bent / np.sqrt((bent * bent).sum(axis=0))
