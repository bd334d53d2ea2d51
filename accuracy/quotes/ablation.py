"""What each effect of a scene costs, measured by leaving it out once.

Prices rank; this measures. The scene is rendered small and with few samples, whole and without each effect in
turns, so that a slow moment of the machine falls on all alike.
"""

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np

from renderer.plan.building import compile_scene
from renderer.plan.plan import RenderPlan
from renderer.rendering import render
from renderer.scenes import LoadedScene
from schemas.pointers import escaped
from schemas.quality import FixedQuality
from schemas.sampling import Antialiasing, LightSampling
from schemas.scene import Scene

PIXELS = 128
"""Longer side of the pilot picture."""

SAMPLES, LIGHT_SAMPLES = 4, 16
"""Camera samples and light points of the pilot, at most."""

ROUNDS = 3
"""How often each picture is rendered; the fastest counts, as nothing can make a picture faster than it is."""

STRENGTHS = {
    "specular": "highlights",
    "normal_map": "normal map",
    "bump_map": "bump map",
    "displacement_map": "displacement",
    "mirror": "mirror",
    "transmission": "transmission",
}
"""Fields of a material that can be switched off, and what they are called."""

PLAIN = (0.5, 0.5, 0.5)
"""The colour that takes the place of a texture."""


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


@dataclass(frozen=True, slots=True)
class Marginal:
    """What one effect adds to a picture.

    Attributes
    ----------
    effect : str
    pointers : tuple of str
    seconds : float
        CPU seconds of the pilot that go when the effect goes; below 0 where it saves work.
    share : float
        The same as a share of the pilot with all effects.
    difference : float
        RMSE between the pictures with and without it, of linear values clipped to 0..1.
    """

    effect: str
    pointers: tuple[str, ...]
    seconds: float
    share: float
    difference: float


def variants(document: Scene) -> Iterator[Variant]:
    """The scene without each light, each part of its materials, its lens, its antialiasing."""
    for number in range(len(document.lights)):
        others = document.lights[:number] + document.lights[number + 1 :]
        yield Variant(
            f"light {number}", (f"/lights/{number}",), document.model_copy(update={"lights": others})
        )
    for field, effect in STRENGTHS.items():
        asking = [name for name, material in document.materials.items() if getattr(material, field)]
        if asking:
            pointers = tuple(f"/materials/{escaped(name)}/{field}" for name in asking)
            yield Variant(effect, pointers, _without_field(document, asking, field))
    textured = [name for name, material in document.materials.items() if material.color_texture]
    if textured:
        pointers = tuple(f"/materials/{escaped(name)}/color_texture" for name in textured)
        plain = _changed(document, textured, {"color_texture": None, "color": PLAIN})
        yield Variant("texture", pointers, plain)
    if document.camera.lens_radius:
        camera = document.camera.model_copy(update={"lens_radius": 0.0})
        yield Variant("lens", ("/camera/lens_radius",), document.model_copy(update={"camera": camera}))
    if document.sampling.antialiasing.samples > 1:
        sampling = document.sampling.model_copy(
            update={"antialiasing": Antialiasing(pattern="center", samples=1)}
        )
        update = {"sampling": sampling}
        yield Variant("antialiasing", ("/sampling/antialiasing",), document.model_copy(update=update))


def _without_field(document: Scene, names: list[str], field: str) -> Scene:
    return _changed(document, names, {field: None if field.endswith("_map") else 0.0})


def _changed(document: Scene, names: list[str], update: dict[str, Any]) -> Scene:
    changed = {name: document.materials[name].model_copy(update=update) for name in names}
    return document.model_copy(update={"materials": {**document.materials, **changed}})


def marginal_costs(scene: LoadedScene) -> tuple[float, list[Marginal]]:
    """CPU seconds of a pilot of the scene, and what each effect adds to it.

    Parameters
    ----------
    scene : LoadedScene

    Returns
    -------
    float, list of Marginal
        Most costly first.
    """
    whole = pilot(scene, scene.document)
    parts = list(variants(scene.document))
    plans = [pilot(scene, variant.document) for variant in parts]
    seconds = np.full(1 + len(plans), np.inf)
    images = []
    for _ in range(ROUNDS):
        results = [render(plan) for plan in (whole, *plans)]
        seconds = np.minimum(seconds, [result.report["cpu_seconds"] for result in results])
        images = [np.clip(result.image.astype(np.float64), 0, 1) for result in results]
    rows = [
        Marginal(
            effect=variant.effect,
            pointers=variant.pointers,
            seconds=float(seconds[0] - spent),
            share=float(1 - spent / seconds[0]),
            difference=float(np.sqrt(np.mean((image - images[0]) ** 2))),
        )
        for variant, spent, image in zip(parts, seconds[1:], images[1:], strict=True)
    ]
    return float(seconds[0]), sorted(rows, key=lambda row: -row.seconds)


def pilot(scene: LoadedScene, document: Scene) -> RenderPlan:
    """The plan of a small picture with few samples, in the scene's own patterns where these allow it."""
    camera = document.camera
    scale = min(1.0, PIXELS / max(camera.width, camera.height))
    size = {"width": max(1, round(camera.width * scale)), "height": max(1, round(camera.height * scale))}
    small = document.model_copy(update={"camera": camera.model_copy(update=size)})
    sampling = document.sampling
    quality = FixedQuality(
        mode="fixed",
        antialiasing=Antialiasing(
            pattern=sampling.antialiasing.pattern, samples=min(SAMPLES, sampling.antialiasing.samples)
        ),
        light=LightSampling(
            pattern=sampling.light.pattern, samples=min(LIGHT_SAMPLES, sampling.light.samples)
        ),
    )
    return compile_scene(LoadedScene(small, scene.assets), quality)
