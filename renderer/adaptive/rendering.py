"""A whole picture of target quality; passes until its error is what was asked for, or the time is spent."""

import time
from collections.abc import Callable
from functools import partial
from typing import Any

import numpy as np

from renderer.adaptive.adaptive_render import AdaptiveRender, render_request
from renderer.adaptive.estimate import Estimate
from renderer.film import BRIGHTEST, non_finite
from renderer.integrator import WORK
from renderer.plan.plan import RenderPlan
from renderer.results import RenderResult, TileEvent
from renderer.workers import shared_out
from schemas.quality import TargetQuality


def render_adaptively(
    plan: RenderPlan,
    quality: TargetQuality,
    on_tile: Callable[[TileEvent], None] | None,
    workers: int | None,
    tile_size: int | None,
) -> RenderResult:
    """Render a whole picture of target quality; parameters as of `renderer.render`."""
    begun = time.monotonic()
    deadline = np.inf if quality.time_limit is None else begun + quality.time_limit
    alone = not on_tile and deadline == np.inf and (workers or 1) == 1
    estimate = Estimate.begin(plan)
    render = AdaptiveRender(plan, tile_size, on_tile, deadline, begun, estimate, 0 if alone else workers or 1)
    with shared_out(workers, partial(render_request, plan)) as each:
        while render.step(each):
            pass
    layers = render.buffers.finished() | estimate.layers(layer.name for layer in plan.layers)
    image = estimate.image()
    return RenderResult(image, layers, _report(render, image))


def _report(render: AdaptiveRender, image: Any) -> dict[str, Any]:
    plan, estimate = render.plan, render.estimate
    assert estimate.error is not None
    shaded = [lighting.emitter.count for lighting in plan.lightings]
    return {
        "seconds": time.monotonic() - render.begun,
        "cpu_seconds": render.cpu_seconds,
        "between_cpu_seconds": render.between_cpu,
        "width": plan.width,
        "height": plan.height,
        "rays": {name: count for name, count in render.counts.items() if name not in WORK},
        "work": {name: render.counts[name] for name in WORK},
        "samples": {
            "antialiasing_mean": float(estimate.counts().mean()),
            "light_mean": float(np.mean(shaded)) if shaded else 0.0,
        },
        "error": estimate.error.document(),
        "passes": render.passes,
        "numerics": {
            "non_finite": non_finite(image),
            "clamped": int(np.count_nonzero((image >= BRIGHTEST).any(axis=2))),
        }
        | plan.numerics,
        "plan": plan.describe().model_dump(mode="json"),
    }
