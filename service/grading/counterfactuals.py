"""Why a picture fails: which mistake, made with the reference scene, gives a picture like it.

Mistakes in the picture alone, such as a flip, are undone by `renderer.comparison.diagnosis`. A missing shadow
cannot be undone, but it can be made: the reference scene is rendered without shadows, and if the picture is
much nearer to this than to the reference, shadows are what is missing.
"""

from __future__ import annotations

import math
import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from functools import partial

import numpy as np

import renderer
from renderer.arrays import Floats
from renderer.comparison import Comparison
from renderer.comparison.blocks import bias
from renderer.comparison.diagnosis import Cause
from renderer.plan import RenderPlan
from renderer.scenes import LoadedScene
from renderer.stages import Lighting
from schemas.quality import FixedQuality
from schemas.sampling import Antialiasing, LightSampling
from service.grading.altered_scenes import Alteration, alterations
from service.grading.altered_shading import shading_changes
from service.grading.hints import HINTS
from service.grading.light_bands import bands

MOST_PIXELS = 20_000
"""Larger pictures are tried smaller: a mistake shows in every size, and each trial renders a picture."""

GLANCE, SAMPLES = 4, 16
"""Camera samples of a first trial, and of a second one of what the first leaves possible."""

LIGHT_POINTS = 16
"""Of a trial. These and camera samples lie on a grid: noise would hide what is looked for."""

HALF = 0.5
"""A mistake is named where making it leaves less than this share of the RMSE,"""

CLEAR = 0.8
"""or less than this and the pictures then agree but for noise."""

MOST = 3
"""Causes told."""

SETTLED = 0.3
"""Nothing is made where undoing a mistake leaves no more than this share of the RMSE: that was it."""

ALIKE = 1.25
"""Other causes are told only if they leave no more than so many times the RMSE of the first."""


Draw = Callable[[int], Floats]
"""From camera samples to a linear picture (H, W, 3)."""


@dataclass(frozen=True, slots=True)
class _Trial:
    """A picture, its reference, and what the mistakes made in turns leave of their difference.

    Attributes
    ----------
    scene : LoadedScene
        In the size of the pictures.
    image, reference, allowed : (H, W, 3) float64
        Linear, 0 to 1; the last is what a block may differ by.
    """

    scene: LoadedScene
    image: Floats
    reference: Floats
    allowed: Floats
    most_bias: float

    def of(self, cause: str, hint: str, draw: Draw) -> Cause | None:
        """The cause that a mistake is, if the picture looks as if it were made."""
        before = _rms(self.image - self.reference)
        if _rms(self.image - np.clip(draw(GLANCE), 0, 1)) >= before:
            return None
        wrong = np.clip(draw(SAMPLES), 0, 1)
        after = _rms(self.image - wrong)
        if after >= CLEAR * before:
            return None
        agree = bias(self.image - wrong, self.allowed).share <= self.most_bias
        return Cause(cause, hint, before, after) if agree or after < HALF * before else None


def explain(scene: LoadedScene, found: Comparison, *, until: float = math.inf) -> tuple[Cause, ...]:
    """Mistakes that explain a difference, the best explanation first: those undone, and those made.

    Parameters
    ----------
    scene
        What the reference shows.
    found
        A comparison that has failed.
    until
        A time of `time.monotonic` after which no other mistake is tried.

    Returns
    -------
    tuple of Cause
        Empty where no single mistake explains the difference, or none was tried in time.
    """
    undone = found.causes
    if undone and undone[0].rmse_after <= SETTLED * undone[0].rmse_before:
        return undone
    trial = _trial(scene, found)
    made = [cause for cause in _made(trial, until) if cause is not None]
    if not (undone or made):
        band = bands(trial.scene, trial.image, trial.reference)
        return () if band is None else (band,)
    named = sorted((*undone, *made), key=lambda cause: cause.rmse_after)
    kept = [cause for cause in named if cause.rmse_after <= ALIKE * named[0].rmse_after]
    return tuple({cause.cause: cause for cause in reversed(kept[:MOST])}.values())[::-1]


def _made(trial: _Trial, until: float) -> Iterator[Cause | None]:
    for cause, about, draw in _mistakes(trial):
        if time.monotonic() >= until:
            return
        yield trial.of(cause, HINTS[cause].format(about), draw)


def _mistakes(trial: _Trial) -> Iterator[tuple[str, str, Draw]]:
    """Cause, what its hint tells, and how to draw the picture with the mistake."""
    for alteration in alterations(trial.scene):
        yield alteration.cause, alteration.about, partial(_drawn, alteration)
    for cause, change in shading_changes(trial.scene):
        yield cause, "", partial(_added, trial.reference, change)


def _added(reference: Floats, change: Callable[[], Floats], samples: int) -> Floats:  # noqa: ARG001
    return reference + change()


def _trial(scene: LoadedScene, found: Comparison) -> _Trial:
    image, reference = found.image, found.reference
    factor = _shrinking(image.width, image.height)
    camera = scene.document.camera.model_copy(
        update={"width": image.width // factor, "height": image.height // factor}
    )
    small = LoadedScene(scene.document.model_copy(update={"camera": camera}), scene.assets)
    rounding = image.rounding + reference.rounding + found.policy.tolerance
    seen, wanted, allowed = (_shrunk(values, factor) for values in (image.linear, reference.linear, rounding))
    return _Trial(small, seen, wanted, allowed, found.policy.most_bias)


def _shrinking(width: int, height: int) -> int:
    """The least whole factor that divides both sides and leaves few pixels, or the largest that divides."""
    common = math.gcd(width, height)
    factors = [factor for factor in range(1, common + 1) if common % factor == 0]
    few = (factor for factor in factors if width * height <= MOST_PIXELS * factor**2)
    return next(few, factors[-1])


def _shrunk(values: Floats, factor: int) -> Floats:
    height, width = values.shape[0] // factor, values.shape[1] // factor
    means: Floats = values.reshape(height, factor, width, factor, 3).mean(axis=(1, 3))
    return means


def _drawn(alteration: Alteration, samples: int) -> Floats:
    """The picture of an altered scene, linear."""
    if not alteration.squeezed:
        return _rendered(alteration.scene, alteration.shadows, samples)
    camera = alteration.scene.document.camera
    # A square of so many pixels is cut into as many columns and rows as the picture has.
    side = math.lcm(camera.width, camera.height)
    square = camera.model_copy(update={"width": side, "height": side})
    document = alteration.scene.document.model_copy(update={"camera": square})
    picture = _rendered(LoadedScene(document, alteration.scene.assets), alteration.shadows, 1)
    blocks = picture.reshape(camera.height, side // camera.height, camera.width, side // camera.width, 3)
    squeezed: Floats = blocks.mean(axis=(1, 3))
    return squeezed


def _rendered(scene: LoadedScene, shadows: bool, samples: int) -> Floats:
    plan = renderer.compile_scene(scene, _quality(scene, samples))
    if not shadows:
        plan = _without_shadows(plan)
    return renderer.render(plan).image.astype(np.float64)


def _quality(scene: LoadedScene, samples: int) -> FixedQuality:
    camera = Antialiasing(pattern="uniform" if samples > 1 else "center", samples=samples)
    light = scene.document.sampling.light
    # One point in the middle is what the scene says if it says so.
    points = 1 if (light.pattern, light.samples) == ("uniform", 1) else LIGHT_POINTS
    return FixedQuality(
        mode="fixed",
        antialiasing=camera,
        light=LightSampling(pattern="uniform", samples=points),
    )


def _without_shadows(plan: RenderPlan) -> RenderPlan:
    lit = tuple(
        replace(light, shadows=()) if isinstance(light, Lighting) else light for light in plan.lightings
    )
    return replace(plan, lightings=lit)


def _rms(difference: Floats) -> float:
    return math.sqrt(float(np.mean(difference * difference)))
