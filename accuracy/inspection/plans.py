"""The plan by which a pixel is inspected: one ray through its middle, light as the picture has it."""

from dataclasses import replace

from renderer.compiling import compile_scene
from renderer.plan.plan import RenderPlan
from renderer.scenes import LoadedScene, QualitySource, Source, load_request
from schemas.quality import FixedQuality, Quality, TargetQuality
from schemas.sampling import Antialiasing, LightSampling

POINTS = 64
"""Points on each light where the picture takes as many as an error asks for: shares to a percent or two."""


def inspection_plan(scene: Source | LoadedScene, quality: QualitySource | None = None) -> RenderPlan:
    """Compile a scene for `inspect`.

    Parameters
    ----------
    scene
        What `load_scene` takes or gives.
    quality
        That of the picture. Its light points and precision are kept, fixed ones; of target quality, which
        takes as many as it needs, the precision alone.

    Raises
    ------
    SceneError
        If the scene, or a file that it names, cannot be used.
    """
    loaded, quality = load_request(scene, quality)
    camera = loaded.document.camera.model_copy(update={"lens_radius": 0.0})
    sharp = replace(loaded, document=loaded.document.model_copy(update={"camera": camera}))
    return compile_scene(sharp, _one_ray(quality))


def _one_ray(quality: Quality | None) -> FixedQuality:
    light = quality.light if isinstance(quality, FixedQuality) else None
    if isinstance(quality, TargetQuality):
        light = LightSampling(pattern="uniform", samples=POINTS)
    return FixedQuality(
        mode="fixed",
        antialiasing=Antialiasing(pattern="center"),
        light=light,
        precision=quality.precision if quality else "single",
    )
