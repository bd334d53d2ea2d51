"""Shadows, light, textures, samples and output without their remedies: textbook formulas, or no guard.

Each function or method has the signature of what it stands for.
"""

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np

from renderer.images.colors import srgb_from_linear
from renderer.interaction import Points
from renderer.lights.emitters import Emitter
from renderer.lights.view import LightView
from renderer.math.arrays import Floats, Masks, dot, unit
from renderer.samplers import PATTERNS, strata
from renderer.shapes.borders import Lift
from renderer.shapes.polygons import Polygons
from renderer.visibility import polygon_grids
from renderer.visibility.ellipsoids import EllipsoidShadows
from tests.numerics.shapes_without_remedies import plain_unit


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


def as_computed(distances: Floats, bounds: Floats, sides: Floats, own: Masks) -> Floats:
    """The same, on a point's own surface too."""
    del bounds, sides, own
    return distances


def stepped_over(distances: Floats, bounds: Floats, sides: Floats, own: Masks) -> Floats:
    """Signed distances without those that a step of a hundredth jumps over."""
    del bounds, sides
    return np.where(own | (np.abs(distances) <= 1e-2), 0.0, distances)


def reached_by_sign(emitter: Emitter, normals: Floats, towards: Floats) -> Masks:
    """Points with some light point above their horizon, by whatever rounding says."""
    spread = np.abs(dot(normals, emitter.first)) + np.abs(dot(normals, emitter.second))
    return dot(normals, towards) + spread / 2 > 0


def reached_by_a_length(emitter: Emitter, normals: Floats, towards: Floats) -> Masks:
    """Points with some light point higher above their horizon than a usual limit, scene units."""
    spread = np.abs(dot(normals, emitter.first)) + np.abs(dot(normals, emitter.second))
    return dot(normals, towards) + spread / 2 > 1e-4


def balls_shade_themselves(stage: EllipsoidShadows, view: LightView) -> None:
    """Ellipsoids between all points and a light, those on them among them."""
    positions = view.of_points(view.points.positions)
    for shape in range(stage.family.numbers.size):
        stage._shade(view, shape, positions, np.arange(view.count))  # noqa: SLF001


def no_rounding(stage: EllipsoidShadows, view: LightView, shape: int, index: Any) -> Floats:
    del stage, view, shape
    return np.zeros(index.size)


def past_the_light(places: Callable[[Emitter], Floats]) -> Callable[[Emitter], Floats]:
    """Places of a light as far away again by a hundredth of their coordinates."""
    return lambda emitter: 1.01 * places(emitter)


def corners_of_cells(emitter: Emitter) -> tuple[Floats, Floats]:
    columns, rows = strata(emitter.count)
    return np.arange(columns) / columns - 0.5, np.arange(rows) / rows - 0.5


SHARED_LIGHT = polygon_grids.shared_light


def shared_light_of_rounded(occluders: Polygons, emitter: Emitter, dtype: Any) -> Any:
    """Numbers of light points formed from occluders that were rounded to the precision of pair work."""
    names = ("normals", "anchors", "edge_normals", "edge_anchors")
    rounded = {name: getattr(occluders, name).astype(dtype).astype(np.float64) for name in names}
    return SHARED_LIGHT(replace(occluders, **rounded), emitter, dtype)


def reflected_in_single(viewers: Floats, shading_normals: Floats, normals: Floats) -> Floats:
    del normals
    v, n = viewers.astype(np.float32), shading_normals.astype(np.float32)
    return (2 * dot(n, v) * n - v).astype(np.float64)


def across_the_view(points: Points, away: Any) -> Floats:
    """Normals across the line of sight, 0/0 where they point straight away."""
    normals, viewers = points.shading_normals[:, away], points.viewers[:, away]
    return plain_unit(normals - viewers * dot(normals, viewers))
