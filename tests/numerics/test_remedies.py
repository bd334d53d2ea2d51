"""Each remedy switched off by itself, and the hard case that fails without it.

What takes a remedy's place is the textbook's formula, or the same code without its guard. A case that still
holds does not need the remedy: then one of the two goes.
"""

import warnings
from collections.abc import Callable, Mapping
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from accuracy.hard_cases import Case, formulas, sections
from accuracy.hard_cases.cameras import plain_disk
from accuracy.hard_cases.textures.normal_maps import plain_tangents
from renderer.images.colors import srgb_from_linear
from renderer.interaction import Points, Rays
from renderer.math.arrays import Floats, dot, unit
from renderer.math.numerics import gamma
from renderer.samplers import PATTERNS
from renderer.shapes import ellipsoids, woop
from renderer.shapes.borders import Lift
from renderer.shapes.ellipsoids import Ellipsoids
from renderer.shapes.family import WHOLE
from renderer.shapes.rectangles import Rectangles
from renderer.shapes.triangles import Triangles
from renderer.textures.image import WRAPS

Patches = Mapping[str, Any]
"""Dotted names, and what stands in their place."""

CASES = {(case.ids[0], case.name): case for section in sections() for case in section.cases}


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

    def meet(family: Rectangles, shape: int, rays: Rays) -> None:
        parts = [part[:, shape] for part in (family.anchors, family.first, family.second)]
        begins = np.broadcast_to(rays.origins, rays.directions.shape).T
        with np.errstate(all="ignore"):
            t = formulas.projected_on_edges(parts, begins, rays.directions.T, limit)
        found = np.flatnonzero(np.isfinite(t))
        places = begins[found] + t[found, None] * rays.directions.T[found] - parts[0]
        u, v = (places @ edge / (edge @ edge) for edge in parts[1:])
        rays.offer(found, t[found], (u, v), family.numbers[shape : shape + 1], WHOLE)

    return meet


def quadratic(dtype: Any) -> Callable[[Ellipsoids, int, Rays], None]:
    """An ellipsoid's hits by b^2 - 4ac, after one matrix that also moves."""

    def meet(family: Ellipsoids, shape: int, rays: Rays) -> None:
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

    return meet


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


def free_to_leave(family: Any, shape: int, departure: Any, found: Any, power: Floats) -> Any:
    del family, shape, departure
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


def trusted(distances: Floats, bounds: Floats, sides: Floats) -> Floats:
    """Signed distances as they were computed."""
    del bounds, sides
    return distances


OUTPUT = "accuracy.hard_cases.samples_and_output.output.displayed"
TRIANGLES = {"renderer.shapes.woop.hits": hits_by(0.0)}
LIMITED = {"renderer.shapes.woop.hits": hits_by(formulas.SMALL)}
PROJECTED = {"renderer.shapes.rectangles.Rectangles.meet": projected(0.0)}
PROJECTED_WITH_LIMIT = {"renderer.shapes.rectangles.Rectangles.meet": projected(formulas.SMALL)}
QUADRATIC = {"renderer.shapes.ellipsoids.Ellipsoids.meet": quadratic(np.float64)}
IN_SINGLE = {"renderer.shapes.ellipsoids.Ellipsoids.meet": quadratic(np.float32)}
UNWRAPPED = {"renderer.textures.image.WRAPS": dict.fromkeys(WRAPS, lambda index, _: index)}
NO_SIDES = {"renderer.visibility.polygons.snapped": trusted, "renderer.visibility.sides.snapped": trusted}

SWITCHED_OFF: dict[tuple[str, str], Patches] = {
    ("A1", "up along the view"): {"renderer.cameras.pinhole.parallel": lambda *_: False},
    ("A1", "length of up"): {"renderer.cameras.pinhole.unit": plain_unit},
    ("A2", "view nearly along up"): {"renderer.cameras.pinhole.basis": once_perpendicular},
    ("A3", "a camera that looks at where it stands"): {"renderer.cameras.pinhole.unit": plain_unit},
    ("A4", "field of view at its ends"): {"renderer.cameras.pinhole.Pinhole.directions": in_single},
    ("A5", "a camera far from the origin"): {"renderer.cameras.pinhole.Pinhole.directions": between_places},
    ("A6", "pictures of one row, one column, one pixel"): {
        "renderer.cameras.pinhole.Pinhole.screen": plain_screen
    },
    ("A8", "a lens far from the origin"): {"renderer.cameras.pinhole.Pinhole.directions": between_places},
    ("A9", "the middle of the lens"): {
        "accuracy.hard_cases.cameras.disk": lambda a, b: plain_disk(2 * a - 1, 2 * b - 1)
    },
    ("B2", "slivers"): LIMITED,
    ("B3", "needles"): LIMITED,
    ("B4", "tiny triangles"): LIMITED,
    ("B4", "one scene in many units"): LIMITED,
    ("B5", "huge triangles"): {"renderer.shapes.woop.hits": hits_in_single},
    ("B6", "rays at a shared edge"): TRIANGLES,
    ("B7", "rays at a shared vertex"): TRIANGLES,
    ("B11", "triangles at a grazing angle"): LIMITED,
    ("B12", "points far from the camera"): {"renderer.shapes.triangles.Triangles.locate": along_the_ray},
    ("B13", "rays that start on a triangle"): {"renderer.shapes.woop._rounding": lambda *_: np.zeros(1)},
    ("B14", "hits close to what their error allows"): {
        "renderer.shapes.woop.gamma": lambda n: 2e9 * gamma(n)
    },
    ("B15", "triangles far from the origin"): {"renderer.shapes.woop.hits": hits_in_single},
    ("C1", "edges that are not perpendicular"): PROJECTED,
    ("C2", "corners of a room"): PROJECTED,
    ("C3", "rectangles at a grazing angle"): PROJECTED_WITH_LIMIT,
    ("C6", "rays exactly through edges and corners"): PROJECTED,
    ("C7", "long and narrow rectangles"): PROJECTED,
    ("C8", "rectangles of any size"): {
        "renderer.shapes.rectangles.Rectangles.meet": projected(formulas.SMALL)
    },
    ("C9", "edges that agree but for rounding"): {"renderer.shapes.rectangles.gamma": lambda _: 0.0},
    ("C10", "rays that start on a rectangle"): {"renderer.shapes.rectangles.gamma": lambda _: 0.0},
    ("D1", "tiny spheres far away"): QUADRATIC,
    ("D2", "a giant sphere as the ground"): IN_SINGLE,
    ("D3", "starts close to the surface"): IN_SINGLE,
    ("D4", "axes a million to one"): QUADRATIC,
    ("D5", "centres far from the origin"): QUADRATIC,
    ("D6", "starts inside"): IN_SINGLE,
    ("D7", "exactly tangent rays"): QUADRATIC,
    ("D8", "nearly tangent rays"): IN_SINGLE,
    ("D9", "starts on the surface"): QUADRATIC,
    ("D10", "ellipsoids behind the start"): IN_SINGLE,
    ("D11", "directions of any length"): QUADRATIC,
    ("D13", "normals of flat ellipsoids"): {
        "renderer.shapes.ellipsoids.Ellipsoids.locate": normals_by_the_axes
    },
    ("D15", "texture coordinates at the poles"): {"renderer.shapes.ellipsoids._angles": by_arc_cosine},
    ("E8", "a place under a seam"): {
        "renderer.visibility.polygon_grids.outward": lambda values, dtype: values.astype(dtype),
        "renderer.visibility.polygons.SURFACE": 0.0,
    },
    ("E14", "walls at a sharp angle"): NO_SIDES,
    ("E15", "the seams of a flat floor"): NO_SIDES,
    ("F1", "exponent 0"): {"renderer.materials.phong._powers": plain_powers},
    ("F2", "powers of negative cosines"): {
        "renderer.materials.phong._powers": powers_of_any_sign,
        "renderer.lights.view.LightView.cosines": cosines_of_any_sign,
    },
    ("F3", "very sharp highlights"): {"renderer.plan.lights.SHARP": 1e30},
    ("F5", "shading normals that face away"): {"renderer.materials.horizon._at_horizon": left_black},
    ("F7", "straight into the mirrored light"): {"renderer.materials.phong._powers": plain_powers},
    ("G1", "the borders of an image"): UNWRAPPED,
    ("G2", "tiny negative coordinates"): UNWRAPPED,
    ("G3", "huge coordinates"): {"renderer.textures.image.ImageTexture._texel": without_reduction},
    ("G4", "constant images"): {"renderer.textures.image.ImageTexture._bilinear": four_weights},
    ("G5", "the poles of a ball"): {"renderer.shapes.ellipsoids._angles": by_arc_cosine},
    ("G6", "fields smaller than pixels"): {"renderer.textures.footprints.Footprints.run": no_footprints},
    ("G7", "normal-map texels that say nothing"): {"renderer.materials.maps.FLAT": 0.0},
    ("G8", "frames near the lower pole"): {
        "accuracy.hard_cases.textures.normal_maps.frame_of_normals": plain_tangents
    },
    ("G8", "tangents that say nothing"): {
        "renderer.materials.maps.SHORT": -1.0,
        "renderer.shapes.frames.SHORT": -1.0,
    },
    ("G9", "edges of displaced faces"): {"renderer.shapes.displacement._lift": unwelded},
    ("G10", "flat height maps"): {"renderer.shapes.displacement._turned": lambda _, moved: moved},
    ("G12", "edges of displaced neighbours"): {"renderer.shapes.displacement.join": lambda _: None},
    ("H2", "rays at the edges of boxes"): {
        "renderer.accelerators.bvh.WIDENING": 0.0,
        "renderer.accelerators.bvh.gamma": lambda _: 0.0,
    },
    ("H4", "rays that are not finite"): {
        "renderer.tracing.finite": lambda values: np.ones(values.shape[1], dtype=bool)
    },
    ("H6", "the critical angle"): {"renderer.materials.optics.transmitted_cosine": plain_transmitted_cosine},
    ("H8", "a ray that leaves glass"): {"renderer.shapes.ellipsoids.Ellipsoids._departed": free_to_leave},
    ("H9", "glass of index 1"): {"renderer.materials.optics.transmitted_cosine": plain_transmitted_cosine},
    ("H11", "shapes that overlap in one plane"): {
        "renderer.plan.overlaps.overlapping": lambda *_: (np.zeros(0, dtype=np.int64),) * 2
    },
    ("I1", "a turned grid that leaves the pixel"): {
        "accuracy.hard_cases.samples_and_output.samples.PATTERNS": {**PATTERNS, "rotated": not_wrapped}
    },
    ("I3", "random numbers and tiles"): {"renderer.samplers.patterns.bits": in_turn(1)},
    ("I4", "a million samples"): {
        "accuracy.hard_cases.samples_and_output.samples.halving_sum": summed_in_order
    },
    ("I5", "samples that are nearly equal"): {"renderer.layers.spread.Spread.add": plain_spread},
    ("I6", "numbers that are no brightness"): {OUTPUT: shown(clipped=False, rounded=True)},
    ("I7", "all codes there and back"): {OUTPUT: shown(clipped=True, rounded=False)},
    ("I8", "the toe of the curve"): {OUTPUT: shown(clipped=False, rounded=True)},
    ("I9", "very bright and quite black"): {"renderer.film.BRIGHTEST": np.inf},
    ("I10", "random numbers just below 1"): {
        "accuracy.hard_cases.samples_and_output.samples.uniforms": lambda drawn: drawn * 2.0**-32
    },
    ("J3", "very small numbers"): {"accuracy.hard_cases.scene_values.values.unit": plain_unit},
    ("J11", "fused products in edge functions"): {"renderer.shapes.woop._sheared": fused_sheared},
}


def fails(case: Case) -> bool:
    """Whether a case has wrong answers, or breaks off."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        try:
            return case.run().wrong > 0
        except (ArithmeticError, IndexError, ValueError):
            return True


@pytest.mark.parametrize("named", SWITCHED_OFF, ids=" ".join)
def test_a_case_fails_without_its_remedy(named: tuple[str, str], monkeypatch: pytest.MonkeyPatch) -> None:
    for name, instead in SWITCHED_OFF[named].items():
        monkeypatch.setattr(name, instead)
    assert fails(CASES[named])
