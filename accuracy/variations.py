"""Variations of a scene: another size, seed or quality, and each of its effects left out."""

from collections.abc import Iterator
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from accuracy.statistics import clipped, rms_difference
from renderer.compiling import compile_scene
from renderer.plan.plan import RenderPlan
from renderer.plan.strengths import effective
from renderer.rendering import render
from renderer.scenes import LoadedScene
from schemas.pointers import escaped
from schemas.quality import Antialiasing, FixedQuality, Quality, Sampling, TargetQuality
from schemas.scene import Scene

SIDE, SAMPLES, LIGHT_SAMPLES = 128, 4, 16
"""Longer side, and most camera samples and light points, of the pictures of `marginal_costs`."""

RENDERS_EACH = 3
"""Renders of each picture; the fastest counts, since interference only adds time."""

STRENGTHS = {
    "specular": "highlights",
    "normal_map": "normal map",
    "bump_map": "bump map",
    "displacement_map": "displacement",
    "mirror": "mirror",
    "transmission": "transmission",
}
"""Fields of a material that can be switched off, and their names."""

PLAIN_COLOR = (0.5, 0.5, 0.5)
"""Colour that replaces a texture."""


def fixed_quality(
    pattern: str, samples: int, light_pattern: str, points: int, precision: str = "single"
) -> FixedQuality:
    """Fixed quality with these camera samples and light points."""
    return FixedQuality.model_validate(
        {
            "mode": "fixed",
            "antialiasing": {"pattern": pattern, "samples": samples},
            "light": {"pattern": light_pattern, "samples": points},
            "precision": precision,
        }
    )


def few_samples(sampling: Sampling, samples: int, points: int) -> FixedQuality:
    """A scene's own patterns with at most these camera samples and light points."""
    camera, light = sampling.antialiasing, sampling.light
    return fixed_quality(
        camera.pattern, min(samples, camera.samples), light.pattern, min(points, light.samples)
    )


def label(quality: Quality) -> str:
    """A quality in a few words.

    Examples
    --------
    >>> label(fixed_quality("rotated", 16, "uniform", 4)), label(TargetQuality(mode="target", error=2 / 255))
    ('rotated 16 x uniform 4', 'target 2/255')
    """
    if isinstance(quality, TargetQuality):
        return f"target {255 * quality.error:.3g}/255"
    camera, light = quality.antialiasing, quality.light
    assert camera is not None
    assert light is not None
    return f"{camera.pattern} {camera.samples} x {light.pattern} {light.samples}"


def resized(document: Scene, side: int) -> Scene:
    """The scene with at most `side` pixels along its longer side, in the same proportions.

    Examples
    --------
    >>> from schemas.reading import read_scene
    >>> camera = {"position": [0, 0, 1], "look_at": [0, 0, 0], "width": 300, "height": 200}
    >>> small = resized(read_scene({"version": 1, "camera": camera})[0], 150)
    >>> small.camera.width, small.camera.height
    (150, 100)
    """
    camera = document.camera
    scale = min(1.0, side / max(camera.width, camera.height))
    width, height = (max(1, round(length * scale)) for length in (camera.width, camera.height))
    return document.model_copy(update={"camera": camera.resized(width, height)})


def seeded(scene: LoadedScene, seed: int) -> LoadedScene:
    """The scene with other random numbers."""
    sampling = scene.document.sampling.model_copy(update={"seed": seed})
    return replace(scene, document=scene.document.model_copy(update={"sampling": sampling}))


@dataclass(frozen=True, slots=True)
class Variant:
    """A scene without one of its effects.

    Attributes
    ----------
    effect : str
    pointers : tuple of str
        Lines of the scene that ask for the effect.
    document : Scene
    """

    effect: str
    pointers: tuple[str, ...]
    document: Scene


def variants(document: Scene) -> Iterator[Variant]:
    """The scene without each light, each part of its materials, its lens, its antialiasing."""
    document = effective(document)
    for number in range(len(document.lights)):
        others = document.lights[:number] + document.lights[number + 1 :]
        changed = document.model_copy(update={"lights": others})
        yield Variant(f"light {number}", (f"/lights/{number}",), changed)
    for part, effect in STRENGTHS.items():
        off = {part: None if part.endswith("_map") else 0.0}
        yield from _without_part(document, effect, part, off)
    yield from _without_part(
        document, "texture", "color_texture", {"color_texture": None, "color": PLAIN_COLOR}
    )
    if document.camera.lens_radius:
        camera = document.camera.model_copy(update={"lens_radius": 0.0})
        yield Variant("lens", ("/camera/lens_radius",), document.model_copy(update={"camera": camera}))
    if document.sampling.antialiasing.samples > 1:
        center = {"antialiasing": Antialiasing(pattern="center", samples=1)}
        changed = document.model_copy(update={"sampling": document.sampling.model_copy(update=center)})
        yield Variant("antialiasing", ("/sampling/antialiasing",), changed)


def _without_part(document: Scene, effect: str, part: str, off: dict[str, Any]) -> Iterator[Variant]:
    """The scene with a part of its materials switched off, if any of them has it."""
    asking = [name for name, material in document.materials.items() if getattr(material, part)]
    if asking:
        pointers = tuple(f"/materials/{escaped(name)}/{part}" for name in asking)
        changed = {name: document.materials[name].model_copy(update=off) for name in asking}
        yield Variant(
            effect, pointers, document.model_copy(update={"materials": {**document.materials, **changed}})
        )


@dataclass(frozen=True, slots=True)
class Marginal:
    """The cost of one effect, and what it changes in the picture.

    Attributes
    ----------
    effect : str
    pointers : tuple of str
    seconds : float
        CPU seconds of the small picture that leaving out the effect saves; below 0 if the effect saves work.
    share : float
        The same as a share of the small picture with all effects.
    difference : float
        RMSE between the pictures with and without it, of linear values clipped to 0..1.
    """

    effect: str
    pointers: tuple[str, ...]
    seconds: float
    share: float
    difference: float


def marginal_costs(scene: LoadedScene) -> tuple[float, list[Marginal]]:
    """CPU seconds of a small picture of the scene, and what each effect adds to it, most costly first.

    It is rendered with few samples, whole and without each effect in turns, so that a slow moment of the
    machine affects all equally.
    """
    parts = list(variants(scene.document))
    plans = [_small(scene, document) for document in (scene.document, *(part.document for part in parts))]
    seconds = np.full(len(plans), np.inf)
    images = []
    for _ in range(RENDERS_EACH):
        results = [render(plan) for plan in plans]
        seconds = np.minimum(seconds, [result.report["cpu_seconds"] for result in results])
        images = [clipped(result.image) for result in results]
    whole = float(seconds[0])
    rows = [
        Marginal(
            effect=part.effect,
            pointers=part.pointers,
            seconds=whole - float(spent),
            share=1 - float(spent) / whole,
            difference=rms_difference(image, images[0]),
        )
        for part, spent, image in zip(parts, seconds[1:], images[1:], strict=True)
    ]
    return whole, sorted(rows, key=lambda row: -row.seconds)


def _small(scene: LoadedScene, document: Scene) -> RenderPlan:
    quality = few_samples(document.sampling, SAMPLES, LIGHT_SAMPLES)
    return compile_scene(LoadedScene(resized(document, SIDE), scene.assets), quality)
