"""What each effect of a scene costs, measured by leaving it out once.

Prices rank; this measures. The scene is rendered small and with few samples, whole and without each effect in
turns, so that a slow moment of the machine falls on all alike.
"""

from collections.abc import Iterator
from dataclasses import dataclass, field
from functools import partial
from typing import Any

import numpy as np

from accuracy.quotes import places
from accuracy.quotes.deadlines import Deadline, within
from accuracy.quotes.settings import compiled
from accuracy.quotes.timings import FIRST
from renderer.compiling import compile_scene
from renderer.integrator import render_tile
from renderer.plan.plan import RenderPlan
from renderer.rendering import render
from renderer.scenes import LoadedScene
from schemas.pointers import escaped
from schemas.quality import FixedQuality
from schemas.sampling import Antialiasing, LightSampling
from schemas.scene import Scene
from schemas.tiles import Tile

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

BLOCKS = 4
"""Blocks in which an effect is left out, spread over the picture."""

SIDE = 32
"""Their side, pixels: a thousand rays cost much more than the calls that they take."""

TURNS = 2
"""How often each block is rendered, with and without; the faster one counts, as nothing can make a block
faster than it is."""


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
    for part, effect in STRENGTHS.items():
        asking = [name for name, material in document.materials.items() if getattr(material, part)]
        if asking:
            pointers = tuple(f"/materials/{escaped(name)}/{part}" for name in asking)
            yield Variant(effect, pointers, _without_part(document, asking, part))
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


def _without_part(document: Scene, names: list[str], part: str) -> Scene:
    return _changed(document, names, {part: None if part.endswith("_map") else 0.0})


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


@dataclass(frozen=True, slots=True)
class Without:
    """An effect, and the share of the CPU seconds that goes when it goes."""

    variant: Variant
    share: float


@dataclass(slots=True)
class Ablation:
    """Leaves out one effect after another.

    Attributes
    ----------
    scene : LoadedScene
    quality : FixedQuality
    plan : RenderPlan
        That of the quality with all effects.
    found : list of Without
    """

    scene: LoadedScene
    quality: FixedQuality
    plan: RenderPlan
    found: list[Without] = field(default_factory=list)

    def run(self, deadline: Deadline, first: float) -> None:
        """Measure effects until the deadline; the first is taken to last at least `first` seconds."""
        for effect in within(deadline, self._units(), first):
            self.found.append(effect)

    def _units(self) -> Iterator[partial[Without]]:
        for variant in variants(self.scene.document):
            # The price of more samples is known from the ladder.
            if variant.effect != "antialiasing":
                yield partial(self._measure, variant)

    def _measure(self, variant: Variant) -> Without:
        plan = compiled(LoadedScene(variant.document, self.scene.assets), self.quality)
        size = self.plan.width, self.plan.height
        tiles = places.cells(*size, SIDE, self.plan.seed)[:BLOCKS]
        with_it, without = (sum(_fastest(each, tile) for tile in tiles) for each in (self.plan, plan))
        return Without(variant, 1 - without / with_it if with_it else 0.0)


def _fastest(plan: RenderPlan, tile: Tile) -> float:
    return min(render_tile(plan, tile, FIRST).cpu_seconds for _ in range(TURNS))
