"""Access to the renderer: rays, points, radiance; and 50 digits for irrational answers."""

from collections import Counter
from collections.abc import Sequence
from typing import Any

import mpmath
import numpy as np

import renderer
from renderer.integrator import intersect, local_radiance
from renderer.interaction import Points, Rays
from schemas.errors import SceneError
from schemas.quality import FixedQuality
from schemas.reading import read_scene
from tests.documents import Json, sampled, scene
from tests.pictures.parts import DOUBLE, SINGLE, plan_of

EPS = 2.0**-52
QUALITIES = (SINGLE, DOUBLE)
UP = np.array([[0.0], [1.0], [0.0]])

mp = mpmath.MPContext()
mp.dps = 50


def eps_of(quality: FixedQuality) -> float:
    return float(np.finfo(quality.precision).eps)


def traced(
    shapes: Sequence[Json],
    origins: Any,
    directions: Any,
    *,
    lights: Sequence[Json] = (),
    points: int = 1,
    pattern: str = "uniform",
    quality: FixedQuality | None = None,
) -> renderer.Hits:
    document = scene(*shapes, lights=lights, sampling=sampled(1, points, light=pattern))
    return renderer.trace(plan_of(document, quality), origins, directions)


def towards(origin: Sequence[float], targets: Any) -> tuple[Any, Any]:
    """Rays from one place at many."""
    targets = np.asarray(targets, dtype=np.float64)
    return np.broadcast_to(np.asarray(origin, dtype=np.float64), targets.shape), targets - origin


def rays_of(origins: Any, directions: Any) -> Rays:
    """Rays (3, N), each of a pixel of its own."""
    numbers = np.arange(directions.shape[1])
    return Rays(origins, np.ascontiguousarray(directions), numbers, np.zeros_like(numbers))


def points(plan: renderer.RenderPlan, origins: Any, directions: Any) -> Points:
    """Points that rays (3, N) hit, ready for lighting."""
    return intersect(plan, rays_of(np.ascontiguousarray(origins), directions), lights=False)


def radiance(plan: renderer.RenderPlan, origins: Any, directions: Any) -> Any:
    """Radiance (3, N) along rays (3, N), without what comes by further rays."""
    return local_radiance(plan, rays_of(np.ascontiguousarray(origins), directions), Counter())[0]


def problems(source: Json | bytes) -> list[str]:
    """Pointers of what a scene is refused for."""
    try:
        read_scene(source)
    except SceneError as refused:
        return [problem.pointer for problem in refused.errors]
    return []


def read_shape(document: Json) -> Any:
    return read_scene(scene(document))[0].shapes[0]
