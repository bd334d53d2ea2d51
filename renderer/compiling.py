"""From a scene to the plan of a picture, for fixed quality or for a target."""

from collections import Counter
from collections.abc import Iterable
from dataclasses import replace

import numpy as np

from renderer.adaptive.planning.building import adapted
from renderer.cameras import Window
from renderer.integrator import intersect, successors
from renderer.interaction import Rays
from renderer.math.arrays import Floats
from renderer.plan.building import build_plan
from renderer.plan.geometry import build_geometry
from renderer.plan.plan import RenderPlan, seen_by
from renderer.plan.request import Request
from renderer.scenes import LoadedScene, QualitySource, Source, load_request
from renderer.waves import WaitingWaves, camera_wave
from schemas.api.layers import checked_layers

SIDE = 16
"""Camera rays along each axis of the picture that say which share of it sends rays on."""

FOLLOWED = 8
"""How many of them are followed to their ends: the price of bounces is then right within a factor of 2."""


def compile_scene(
    scene: Source | LoadedScene,
    quality: QualitySource | None = None,
    *,
    layers: Iterable[str] = (),
    culling: bool = True,
) -> RenderPlan:
    """Decide what a scene calls for, and build just that.

    Parameters
    ----------
    scene
        What `load_scene` takes or gives.
    quality
        Takes the place of the scene's own sampling: `schemas.FixedQuality`, `schemas.TargetQuality`, or a
        dict as a request over HTTP has it.
    layers
        What to record about each pixel beside its colour, by names of `schemas.api.layers.LAYER_NAMES`.
    culling
        Whether conservative tests may leave out work. Images are the same without, and slower.

    Returns
    -------
    RenderPlan

    Raises
    ------
    SceneError
        If the scene, a file that it names, or the quality cannot be used; pointers into the quality begin
        with ``/quality``.
    ValueError
        If there is no layer of some name.
    """
    names = checked_layers(layers)
    loaded, asked = load_request(scene, quality)
    return _compiled(Request(loaded, asked, build_geometry(loaded), culling, names))


def at_quality(plan: RenderPlan, quality: QualitySource) -> RenderPlan:
    """The plan of the same scene and layers at another quality; raises as `compile_scene` does for it."""
    loaded, asked = load_request(plan.scene, quality)
    names = tuple(layer.name for layer in plan.layers)
    return _compiled(Request(loaded, asked, plan.geometry, plan.culling, names))


def _compiled(request: Request) -> RenderPlan:
    plan = build_plan(request)
    if plan.scattering:
        plan = _with_bounces_priced(plan)
    if request.target is not None:
        plan = adapted(plan, request, request.target)
    crop = request.document.camera.crop
    return seen_by(plan, Window.of(plan.camera, crop)) if crop else plan


def _with_bounces_priced(plan: RenderPlan) -> RenderPlan:
    """The plan with the price of bounces, which no formula tells: nested glass multiplies them."""
    bounces = _bounces(plan)
    entries = tuple(
        replace(entry, seconds=entry.seconds * bounces[kind])
        if (kind := entry.effect.removeprefix("materials.phong.")) in bounces
        else entry
        for entry in plan.entries
    )
    return replace(plan, entries=entries)


def _bounces(plan: RenderPlan) -> dict[str, float]:
    """Mean numbers of mirror and transmitted rays that a camera ray makes, by following a few."""
    x, y = ((np.arange(SIDE) + 0.5) * size / SIDE for size in (plan.width, plan.height))
    x, y = np.tile(x, SIDE), y.repeat(SIDE)
    first = camera_wave(_rays(plan, x, y))
    points = intersect(plan, first.rays, lights=False)
    sending = np.unique(np.concatenate([[], *(wave.targets for wave in successors(plan, points, first))]))
    few = sending[:: max(1, -(-sending.size // FOLLOWED))].astype(np.int64)
    counts: Counter[str] = Counter()
    waiting = WaitingWaves(camera_wave(_rays(plan, x[few], y[few])))
    while few.size and waiting:
        wave = waiting.next()
        wave.count(counts)
        waiting.add(successors(plan, intersect(plan, wave.rays, lights=False), wave))
    share = sending.size / first.size / max(1, few.size)
    return {kind: counts[kind] * share for kind in ("mirror", "transmission")}


def _rays(plan: RenderPlan, x: Floats, y: Floats) -> Rays:
    """Rays through places of the picture, in pixels."""
    pixels = plan.camera.numbers(x.astype(np.int64), y.astype(np.int64))
    return Rays(plan.camera.position, plan.camera.directions(x, y), pixels, np.zeros_like(pixels))
