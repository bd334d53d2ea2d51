"""A self-test of one second: properties of the platform's arithmetic, and exact answers of the renderer."""

import math
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np

import renderer
from renderer.images.colors import linear_from_srgb
from renderer.images.files import displayed
from renderer.materials.optics import fresnel
from renderer.math.arrays import Floats
from renderer.math.numerics import EPS, halving_sum
from schemas.scene import Display

Json = dict[str, Any]

NUMPY = "Reinstall NumPy from PyPI: pip install --force-reinstall numpy"
ARITHMETIC = "A library in this process changes arithmetic (built with -ffast-math?): update or remove it."
REPORT = "Install released versions of penumbra-render and NumPy; if it remains, please report it."


@dataclass(frozen=True, slots=True)
class Answer:
    """Result of one test: whether it passed; if not, the cure, and the exception if any."""

    name: str
    right: bool
    cure: str = ""
    error: str = ""


def answers() -> Iterator[Answer]:
    """Run all tests; an exception is a failure."""
    for name, right, cure in _platform():
        yield Answer(name, bool(np.all(right)), cure)
    for name, check in RENDERER.items():
        try:
            yield Answer(name, bool(np.all(check())), REPORT)
        except Exception as raised:  # noqa: BLE001 - a check that raises is wrong, and the others still run
            yield Answer(name, False, REPORT, f"{type(raised).__name__}: {raised}")


def _platform() -> Iterator[tuple[str, Any, str]]:
    for dtype, least in ((np.float64, 5e-324), (np.float32, 1e-45)):
        one, half, tiny = _rows(1, float(np.finfo(dtype).eps) / 2, least, dtype=dtype)
        ties = (one + half == one) & (one + 3 * half == one + 4 * half) & (-one - half == -one)
        yield f"{dtype.__name__} rounds to nearest, ties to even", ties, ARITHMETIC
        yield f"{dtype.__name__} has denormal numbers", tiny + tiny > 0, ARITHMETIC
    x, y = _rows(1 + 2.0**-30, 1 + 2.0**-29)
    yield "products are rounded before they are added", x * x - y == 0, NUMPY
    large, one = _rows(2**24, 1, dtype=np.float32)
    yield "float32 is not widened", large + one - large == 0, NUMPY
    yield "square roots are rounded once", np.sqrt(np.arange(999.0) ** 2) == np.arange(999.0), NUMPY
    yield "fmin leaves out NaN", np.fmin(*_rows(math.nan, 1)) == 1, NUMPY


def _rows(*values: float, dtype: type[np.floating] = np.float64) -> Floats:
    """Each value nine times: long enough for vector instructions."""
    return np.repeat(np.array(values, dtype=dtype)[:, None], 9, axis=1)


def _plan(*shapes: Json, material: Json | None = None, camera: Json | None = None, **more: Any) -> Any:
    view = {"position": [0, 2, 6], "look_at": [0, 0, 0], "width": 9, "height": 7} | (camera or {})
    plain = {"type": "phong", "color": [1, 1, 1], "ambient": 0, "diffuse": 1} | (material or {})
    placed = [{"material": "plain", **shape} for shape in shapes]
    parts = {"version": 1, "camera": view, "materials": {"plain": plain}, "shapes": placed}
    return renderer.compile_scene(renderer.load_scene(parts | more))


def _hits(shapes: list[Json], origin: Any, ways: Any, **more: Any) -> renderer.Hits:
    origins, directions = np.broadcast_arrays(np.array(origin, float), np.array(ways, float))
    return renderer.trace(_plan(*shapes, **more), np.atleast_2d(origins), np.atleast_2d(directions))


def _triangle(*vertices: Any) -> Json:
    return {"type": "triangle", "vertices": list(vertices)}


def _rectangle(corner: Any, *edges: Any) -> Json:
    return {"type": "rectangle", "corner": corner, "edges": list(edges)}


def _misses(shape: Json, origin: Any, way: Any, t: float) -> float:
    """Relative error of a distance; 0 if both are infinite."""
    found = float(_hits([shape], origin, way).t[0])
    return 0.0 if found == t else abs(found / t - 1)


def _visibility(light: Json, *above: Json, at: float = 0.0) -> Floats:
    """Share of a light that is visible from points of a floor, `at` units away along x."""
    points = np.array([[x + at, 0, z] for x in (-0.9, -0.1, 0.1, 0.9) for z in (-0.7, 0.3)])
    start, grid = [at + 0.3, 0.01, 0.2], {"light": {"pattern": "uniform", "samples": 16}}
    floor = _rectangle([at - 4, 0, -4], [0, 0, 8], [8, 0, 0])
    return _hits([floor, *above], start, points - start, lights=[light], sampling=grid).visibility[:, 0]


def _highlight(tilt: float) -> float:
    """Highlight of exponent 1e7, at an angle from the mirror direction."""
    eye = {"position": [math.sin(tilt), math.cos(tilt), 0], "up": [0, 0, 1], "width": 1, "height": 1}
    shiny = {"diffuse": 0, "specular": 1, "shininess": 1e7}
    sun = {"type": "directional", "direction": [0, -1, 0], "color": [1, 1, 1]}
    return float(
        renderer.render(_plan(TILE, material=shiny, camera=eye, lights=[sun], sampling=CENTER)).image[0, 0, 0]
    )


def _lens() -> Any:
    """Distances at which the rays of one pixel pass their point in focus, far from the origin."""
    view = {"position": [1e7] * 3, "look_at": [1e7, 1e7, 1e7 - 4], "lens_radius": 0.5}
    lens, samples = _plan(TILE, camera=view).camera, np.arange(64)
    origins, ways = lens.rays(np.full(64, 1.5), np.full(64, 2.5), 0 * samples, samples)
    return np.abs(np.ptp(origins - 1e7 + 4 * ways, axis=1))


TILE = _rectangle([-4, 0, -4], [0, 0, 8], [8, 0, 0])
SEAM = [_triangle([0, 0, 0], [1, 0, 0], [0, 1, 0]), _triangle([1, 1, 0], [0, 1, 0], [1, 0, 0])]
SMALL = _triangle([0, 0, 0], [1e-15, 0, 0], [0, 1e-15, 0])
FAR = {"type": "ellipsoid", "center": [0, 0, -1e4], "radius": 1}
GLOBE = {"type": "ellipsoid", "center": [0, -1e6, 0], "radius": 1e6}
HALF = _rectangle([0, 1, -9], [9, 0, 0], [0, 0, 18])
LAMP = {"type": "rectangle", "corner": [-1, 2, -1], "edges": [[2, 0, 0], [0, 0, 2]], "color": [1, 1, 1]}
BULB = {"type": "point", "position": [1e7 + 9, 0.03, 0], "color": [1, 1, 1]}
CENTER = {"antialiasing": {"pattern": "center", "samples": 1}}
UP, DOWN, TINY = np.array([[0.0], [1.0], [0.0]]), [0, 0, -1], 2.0**-20
ON_SEAM = [[k / 7, 1 - k / 7, -3] for k in range(8)]
BELOW = np.array([[math.sqrt(1 - c * c), c, 0] for c in (math.sqrt(5) / 3 - 1e-15, 0.7, 1)]).T
CODES = np.arange(256)
SHADES = linear_from_srgb(CODES / 255)[None, :, None].repeat(3, axis=2)

RENDERER: dict[str, Callable[[], Any]] = {
    "shared edge": lambda: _hits(SEAM, [0, 0, 3], ON_SEAM).t == 1,
    "grazing ray": lambda: _misses(TILE, [-1, TINY, 0], [1, -TINY, 0], 1) == 0,
    "ray in a plane": lambda: _misses(TILE, [-9, 0, 0], [1, 0, 0], math.inf) == 0,
    "start on a surface": lambda: _misses(TILE, [0.3, 0, 0.7], [0.1, 1, 0.2], math.inf) == 0,
    "tiny triangle": lambda: _misses(SMALL, [3e-16, 3e-16, 1], DOWN, 1) <= 4 * EPS,
    "far ellipsoid": lambda: _misses(FAR, [0, 0, 0], DOWN, 9999) <= 1e-12,
    "giant ground": lambda: _misses(GLOBE, [0, 2, 0], [0, -1, 0], 2) <= 4e6 * EPS,
    "thin lens": lambda: _lens() <= 1e-8,
    "total reflection": lambda: abs(fresnel(BELOW, UP, np.full(3, 1.5)) - [1, 1, 0.04]) <= 4 * EPS,
    "highlight in the mirrored light": lambda: abs(_highlight(0) - 1) <= 1e-6,
    "highlight beside it": lambda: abs(_highlight(3e-4) / math.cos(3e-4) ** 1e7 - 1) <= 1e-6,
    "half-covered light": lambda: abs(_visibility(LAMP, HALF).mean() - 0.5) <= 1e-6,
    "floor in its own shadow": lambda: _visibility(BULB, at=1e7) == 1,
    "light in the floor": lambda: _visibility(LAMP | {"corner": [2, 0, 2]}) == 0,
    "colour codes": lambda: displayed(SHADES, Display())[0, :, 0] == CODES,
    "a million samples": lambda: abs(halving_sum(np.full((10**6, 1), 0.1))[0] / 1e5 - 1) <= 4 * EPS,
}
