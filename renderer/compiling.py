"""From a scene to the plan of a picture, for fixed quality or for a target."""

from collections.abc import Iterable

from renderer.adaptive.planning.building import adapted
from renderer.cameras import Window
from renderer.plan.building import build_plan
from renderer.plan.geometry import build_geometry
from renderer.plan.plan import RenderPlan, seen_by
from renderer.plan.request import Request
from renderer.scenes import LoadedScene, QualitySource, Source, load_request
from schemas.api.layers import checked_layers


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
    if request.target is not None:
        plan = adapted(plan, request, request.target)
    crop = request.document.camera.crop
    return seen_by(plan, Window.of(plan.camera, crop)) if crop else plan
