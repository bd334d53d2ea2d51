"""The short way from shapes and rays to what `trace` says of them."""

from collections.abc import Sequence
from typing import Any

import numpy as np

import renderer
from accuracy.hard_cases.documents import Json, sampled, scene
from schemas.quality import FixedQuality
from tests.pictures.parts import plan_of

EPS = 2.0**-52


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
