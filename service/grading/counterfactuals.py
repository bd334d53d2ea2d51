"""Diagnose a failed picture by reproducing likely mistakes with the reference scene.

`accuracy.comparison.diagnosis` undoes mistakes of the picture alone, such as a flip. A missing shadow cannot
be undone, but it can be reproduced: the reference scene is rendered without shadows, and if the picture is
much closer to that than to the reference, its shadows are missing.
"""

from __future__ import annotations

import math
import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

import renderer
from accuracy.comparison import Comparison
from accuracy.comparison.blocks import bias
from accuracy.comparison.diagnosis import Cause
from renderer.math.arrays import Floats
from renderer.plan.plan import RenderPlan
from renderer.plan.stages import Lighting
from renderer.scenes import LoadedScene
from schemas.quality import Antialiasing, FixedQuality, LightSampling
from service.grading.altered_scenes import Alteration, alterations
from service.grading.altered_shading import shading_changes
from service.grading.hints import HINTS
from service.grading.keeping import kept
from service.grading.light_bands import bands

MOST_PIXELS = 20_000
"""Larger pictures are reduced: a mistake shows at any size, and each trial renders a picture."""

FEW_SAMPLES, SAMPLES = 4, 16
"""Camera samples of the first trial, and of the second one for mistakes that remain possible."""

LIGHT_POINTS = {FEW_SAMPLES: 9, SAMPLES: 16}
"""Light samples by camera samples. Both lie on a grid, because noise would hide the mistake."""

COSTLIER = 8
"""Upper bound on the time of the second trial over the first: 4 times the rays, twice the light samples."""

FINER = 4
"""A picture to be stretched is rendered with this many pixels per pixel of its longer side."""

HALF = 0.5
"""A mistake is named if reproducing it leaves less than this share of the RMSE,"""

SURE = 5.0
"""or if the pixels it changes are closer by this many standard errors and the pictures then agree."""

MOST = 3
"""Largest number of causes in a diagnosis."""

SETTLED = 0.3
"""If undoing a mistake leaves no more than this share of the RMSE, no other is tried."""

EXPOSURE = "exposure"
"""The cause that many shading mistakes resemble."""

ALIKE = 1.25
"""Other causes are listed only if they leave at most this many times the RMSE of the first."""


Draw = Callable[[int], Floats]
"""Renders a linear picture (H, W, 3) with a number of camera samples."""


@dataclass(frozen=True, slots=True, eq=False)
class _Trial:
    """A picture and its reference, against which mistakes are tried in turn.

    Attributes
    ----------
    scene : LoadedScene
        With the size of the pictures.
    image, reference, allowed : (H, W, 3) float64
        Linear, 0 to 1; the last is the difference allowed in a block.
    until : float
        Time limit, by `time.monotonic`.
    keep : Path or None
        Where altered pictures are kept for other submissions.
    """

    scene: LoadedScene
    image: Floats
    reference: Floats
    allowed: Floats
    most_bias: float
    until: float
    keep: Path | None

    def of(self, cause: str, hint: str, draw: Draw) -> Cause | None:
        """The cause, if reproducing the mistake explains the picture."""
        begun, before = time.monotonic(), _rms(self.image - self.reference)
        if _rms(self.image - np.clip(draw(FEW_SAMPLES), 0, 1)) >= before:
            return None
        tried = time.monotonic()
        if tried + COSTLIER * (tried - begun) >= self.until:
            return None
        wrong = np.clip(draw(SAMPLES), 0, 1)
        after = _rms(self.image - wrong)
        explains = after < HALF * before or self._gains(wrong)
        return Cause(cause, hint, before, after) if explains else None

    def _gains(self, wrong: Floats) -> bool:
        """Whether the mistake significantly reduces the error where it shows, and the pictures then agree."""
        gain = ((self.image - self.reference) ** 2 - (self.image - wrong) ** 2).mean(axis=2)
        shown = gain[(np.abs(wrong - self.reference) > self.allowed).any(axis=2)]
        if not shown.size or shown.mean() <= SURE * shown.std() / math.sqrt(shown.size):
            return False
        return bias(self.image - wrong, self.allowed).share <= self.most_bias


def explain(
    scene: LoadedScene, found: Comparison, *, until: float = math.inf, keep: Path | None = None
) -> tuple[Cause, ...]:
    """Mistakes that explain a difference, undone or reproduced, the best explanation first.

    Parameters
    ----------
    scene
        The scene of the reference.
    found
        A failed comparison.
    until
        A time of `time.monotonic` after which no further mistake is tried.
    keep
        A folder of altered pictures that other submissions share.

    Returns
    -------
    tuple of Cause
        Empty if no single mistake explains the difference, or time ran out.
    """
    undone = found.causes
    settled = undone and undone[0].rmse_after <= SETTLED * undone[0].rmse_before
    if settled and undone[0].cause != EXPOSURE:
        return undone
    trial = _trial(scene, found, until, keep)
    made = [cause for cause in _made(trial) if cause is not None]
    if not (undone or made):
        band = bands(trial.scene, trial.image, trial.reference)
        return () if band is None else (band,)
    named = sorted((*undone, *made), key=lambda cause: cause.rmse_after)
    kept = [cause for cause in named if cause.rmse_after <= ALIKE * named[0].rmse_after]
    return tuple({cause.cause: cause for cause in reversed(kept[:MOST])}.values())[::-1]


def _made(trial: _Trial) -> Iterator[Cause | None]:
    for cause, about, draw in _mistakes(trial):
        if time.monotonic() >= trial.until:
            return
        yield trial.of(cause, HINTS[cause].format(about), draw)


def _mistakes(trial: _Trial) -> Iterator[tuple[str, str, Draw]]:
    """Cause, what its hint says about the scene, and a function that renders the mistake."""
    for alteration in alterations(trial.scene):
        yield alteration.cause, alteration.about, partial(_drawn, alteration, trial.keep)
    for cause, change in shading_changes(trial.scene):
        yield cause, "", partial(_added, trial.reference, change)


def _added(reference: Floats, change: Callable[[], Floats], samples: int) -> Floats:  # noqa: ARG001
    return reference + change()


def _trial(scene: LoadedScene, found: Comparison, until: float, keep: Path | None) -> _Trial:
    image, reference = found.image, found.reference
    factor = _shrinking(image.width, image.height)
    camera = scene.document.camera.model_copy(
        update={"width": image.width // factor, "height": image.height // factor}
    )
    small = LoadedScene(scene.document.model_copy(update={"camera": camera}), scene.assets)
    rounding = image.rounding + reference.rounding + found.policy.tolerance
    seen, wanted, allowed = (_shrunk(values, factor) for values in (image.linear, reference.linear, rounding))
    return _Trial(small, seen, wanted, allowed, found.policy.most_bias, until, keep)


def _shrinking(width: int, height: int) -> int:
    """The smallest common divisor of both sides that leaves few enough pixels, or the largest one."""
    common = math.gcd(width, height)
    factors = [factor for factor in range(1, common + 1) if common % factor == 0]
    few = (factor for factor in factors if width * height <= MOST_PIXELS * factor**2)
    return next(few, factors[-1])


def _shrunk(values: Floats, factor: int) -> Floats:
    height, width = values.shape[0] // factor, values.shape[1] // factor
    means: Floats = values.reshape(height, factor, width, factor, 3).mean(axis=(1, 3))
    return means


def _drawn(alteration: Alteration, keep: Path | None, samples: int) -> Floats:
    """The picture of an altered scene, linear."""
    if not alteration.squeezed:
        return _rendered(alteration.scene, alteration.shadows, samples, keep)
    camera = alteration.scene.document.camera
    side = FINER * max(camera.width, camera.height)
    square = camera.model_copy(update={"width": side, "height": side})
    document = alteration.scene.document.model_copy(update={"camera": square})
    picture = _rendered(LoadedScene(document, alteration.scene.assets), alteration.shadows, 1, keep)
    return _means(_means(picture, camera.height, 0), camera.width, 1)


def _means(picture: Floats, count: int, axis: int) -> Floats:
    """Means of `count` parts of a picture along an axis, as equal as its pixels allow."""
    starts = np.arange(count + 1) * picture.shape[axis] // count
    sizes = np.expand_dims(np.diff(starts), [other for other in range(3) if other != axis])
    means: Floats = np.add.reduceat(picture, starts[:-1], axis=axis) / sizes
    return means


def _rendered(scene: LoadedScene, shadows: bool, samples: int, keep: Path | None) -> Floats:
    key = f"{scene.document.model_dump_json()} {shadows} {samples}"
    return kept(keep, key, partial(_image, scene, shadows, samples)).astype(np.float64)


def _image(scene: LoadedScene, shadows: bool, samples: int) -> NDArray[np.float32]:
    plan = renderer.compile_scene(scene, _quality(scene, samples))
    return renderer.render(plan if shadows else _without_shadows(plan)).image


def _quality(scene: LoadedScene, samples: int) -> FixedQuality:
    camera = Antialiasing(pattern="uniform" if samples > 1 else "center", samples=samples)
    light = scene.document.sampling.light
    # A scene with a single light sample keeps it: its hard shadows are intended.
    points = (
        1
        if (light.pattern, light.samples) == ("uniform", 1)
        else LIGHT_POINTS.get(samples, LIGHT_POINTS[FEW_SAMPLES])
    )
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
