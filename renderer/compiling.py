"""Compile a scene to the plan of a picture, for fixed quality or for a target."""

from collections import Counter
from collections.abc import Iterable
from dataclasses import replace

import numpy as np

from renderer.adaptive.planning.building import adapted, samples_of
from renderer.cameras import Window
from renderer.integrator import intersect, successors
from renderer.interaction import Rays, first_of_each
from renderer.math.arrays import Floats
from renderer.plan.building import build_plan
from renderer.plan.geometry import SceneGeometry, build_geometry
from renderer.plan.plan import RenderPlan
from renderer.plan.request import Request
from renderer.scenes import LoadedScene, QualitySource, Source, load_request
from renderer.waves import BOUNCES, COUNTED_AS, camera_wave, joined
from schemas.api.layers import checked_layers
from schemas.quality import Quality, TargetQuality

FOLLOWED_SIDE = 32
"""Camera rays along each axis of the picture whose paths are followed to price bounces."""


def compile_scene(
    scene: Source | LoadedScene,
    quality: QualitySource | None = None,
    *,
    layers: Iterable[str] = (),
    culling: bool = True,
) -> RenderPlan:
    """Compile a scene to a plan with only the stages that it needs.

    Parameters
    ----------
    scene
        Argument or result of `load_scene`.
    quality
        Takes the place of the scene's own sampling: `schemas.FixedQuality`, `schemas.TargetQuality`, or a
        dict as a request over HTTP has it.
    layers
        Values to record of each pixel beside its colour, by names of `schemas.api.layers.LAYER_NAMES`.
    culling
        Whether conservative tests may skip work. Without them images are the same, but slower.

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
    return _compiled(loaded, asked, build_geometry(loaded), names, culling=culling)


def at_quality(plan: RenderPlan, quality: QualitySource) -> RenderPlan:
    """The plan of the same scene and layers at another quality; raises as `compile_scene` does for it."""
    loaded, asked = load_request(plan.scene, quality)
    names = tuple(layer.name for layer in plan.layers)
    return _compiled(loaded, asked, plan.geometry, names, culling=plan.culling)


def _compiled(
    scene: LoadedScene,
    quality: Quality | None,
    geometry: SceneGeometry,
    layers: tuple[str, ...],
    *,
    culling: bool,
) -> RenderPlan:
    target = quality if isinstance(quality, TargetQuality) else None
    of_samples = samples_of(scene, target) if target else quality
    request = Request(scene, of_samples, geometry, culling, layers)
    plan = build_plan(request)
    if plan.scattering:
        plan = _with_bounces_priced(plan)
    if target is not None:
        plan = adapted(plan, request, target)
    crop = request.document.camera.crop
    return plan.seen_by(Window.of(plan.camera, crop)) if crop else plan


def _with_bounces_priced(plan: RenderPlan) -> RenderPlan:
    """The plan with a measured price of bounces, since no formula gives it: nested glass multiplies them."""
    bounces = _bounces(plan)
    entries = tuple(
        replace(entry, seconds=entry.seconds * bounces[kind])
        if (kind := entry.effect.rpartition(".")[2]) in bounces
        else entry
        for entry in plan.entries
    )
    return replace(plan, entries=entries)


def _bounces(plan: RenderPlan) -> Counter[str]:
    """Mean numbers of mirror and transmitted rays that a camera ray makes.

    Of the rays that leave a point one is followed, weighted for all: the mean is unbiased, and every scene
    takes at most one ray per path and bounce (Knuth, "Estimating the efficiency of backtrack programs",
    1975). Right within a factor of 2 for balls of glass, in and beside one another.
    """
    x, y = ((np.arange(FOLLOWED_SIDE) + 0.5) * size / FOLLOWED_SIDE for size in (plan.width, plan.height))
    wave = camera_wave(_rays(plan, np.tile(x, FOLLOWED_SIDE), y.repeat(FOLLOWED_SIDE)))
    random, stands_for = np.random.default_rng(plan.seed), np.ones(wave.size)
    means = Counter[str](mirror=0, transmission=0)
    while scattered := successors(plan, intersect(plan, wave.rays, lights=False), wave):
        leaving = joined(scattered)
        counts = np.bincount(leaving.kinds, stands_for[leaving.parents], len(BOUNCES)) / FOLLOWED_SIDE**2
        for kind, count in zip(BOUNCES, counts.tolist(), strict=True):
            means[COUNTED_AS[kind]] += count
        # The heavier a ray, the more it still sends on, but not in proportion.
        likely = np.sqrt(leaving.weights)
        order = np.lexsort((random.exponential(size=leaving.size) / likely, leaving.parents))
        followed = first_of_each(leaving.parents, order)
        parents = leaving.parents[followed]
        stands_for = stands_for[parents] * np.bincount(leaving.parents, likely)[parents] / likely[followed]
        wave = leaving.part(followed)
    return means


def _rays(plan: RenderPlan, x: Floats, y: Floats) -> Rays:
    """Rays through places of the picture, in pixels."""
    pixels = plan.camera.numbers(x.astype(np.int64), y.astype(np.int64))
    return Rays(plan.camera.position, plan.camera.directions(x, y), pixels, np.zeros_like(pixels))
