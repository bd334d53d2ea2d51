"""Every setting of both renderers on one scene: its true error, and its CPU seconds."""

from __future__ import annotations

import math
import statistics
from functools import partial
from typing import TYPE_CHECKING, TypedDict

import numpy as np

import renderer
from accuracy.variations import fixed_quality, label
from benchmarks.mitsuba_pictures import PATHS, reference, rmse_255, shot
from benchmarks.mitsuba_scene import convert
from benchmarks.report import cpu_seconds
from schemas.quality import TargetQuality
from schemas.reading import read_scene

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator, Sequence

    from numpy.typing import ArrayLike

    from schemas.quality import Quality

OURS, OURS_FIXED, PEER = "Penumbra", "Penumbra fixed", "Mitsuba"
SCENES = "soft", "chess", "lamp", "normal_texturing", "textured_room", "shell", "lens_room"
"""References whose scenes are compared, all 512 x 512."""
ERRORS_255 = (4.0, 2.0, 1.0, 0.5, 0.25, 0.1)
"""Errors at which renderers are compared, in units of 1/255: from a preview to what no display shows."""

RUNS = 3
"""Timed runs of a setting; the median counts."""
SHORT = 2.0
"""CPU seconds of a run above which it counts alone."""
LONGEST = 15.0
"""CPU seconds of a run after which nothing finer is tried in the same way."""

MITSUBA = (1, 2, 4, 8, 16, 30, 64, 132, 256, 506, 1024)
"""Multi-jittered samples a pixel, each with one light point. The sampler rounds none of these up."""

SOBOL = [fixed_quality("sobol", samples, "sobol", 4) for samples in (1, 2, 4, 8, 16, 32, 64, 128, 256)]
"""Fixed samples of ours."""
ASKED = [
    TargetQuality(mode="target", error=factor * error / 255)
    for error in ERRORS_255
    for factor in (math.sqrt(2), 1)
]
"""Targets at these errors and between them, the coarsest first."""
FIRST_SEED = 1000
"""Of Mitsuba's timed pictures: no reference was made with it, so their errors are independent."""


class Run(TypedDict):
    """One setting of one renderer; errors are those of linear values clipped to 0..1 in units of 1/255."""

    renderer: str
    setting: str
    asked_255: float | None
    cpu_seconds: float
    rmse_255: float


def runs_of(scene: str) -> Iterator[Run]:
    """Render a scene with all settings, each way from cheap to expensive as long as it is worth while."""
    converged, own_error_255 = reference(scene)
    for ladder in (_by_mitsuba(scene), _by_penumbra(scene, ASKED), _by_penumbra(scene, SOBOL)):
        for name, setting, target, draw in ladder:
            seconds, image = _timed(draw)
            # The reference's own error is independent, and known from its halves.
            square = rmse_255(image, converged) ** 2 - own_error_255**2
            error = float(np.sqrt(max(square, 0.0)))
            yield Run(renderer=name, setting=setting, asked_255=target, cpu_seconds=seconds, rmse_255=error)
            if seconds > LONGEST or (target is None and error < min(ERRORS_255)):
                break


Setting = tuple[str, str, float | None, "Callable[[int], ArrayLike]"]


def _by_mitsuba(scene: str) -> Iterator[Setting]:
    path = PATHS[scene]
    document, _ = read_scene(path.read_bytes())
    prepared = convert(document, path.parent)
    for samples in MITSUBA:
        draw = partial(shot, prepared, document.camera, samples)
        draw(FIRST_SEED)  # compiles
        yield PEER, f"{samples} samples", None, draw


def _by_penumbra(scene: str, qualities: Sequence[Quality]) -> Iterator[Setting]:
    for quality in qualities:
        plan = renderer.compile_scene(PATHS[scene], quality)
        is_target = isinstance(quality, TargetQuality)
        target = round(255 * quality.error, 4) if isinstance(quality, TargetQuality) else None
        yield OURS if is_target else OURS_FIXED, label(quality), target, partial(_ours, plan)


def _ours(plan: renderer.RenderPlan, _seed: int) -> ArrayLike:
    return renderer.render(plan).image


def _timed(draw: Callable[[int], ArrayLike]) -> tuple[float, ArrayLike]:
    """CPU seconds in the median of some runs after one that warms caches up, and the last picture."""
    seconds: list[float] = []
    for number in range(RUNS + 1):
        begun = cpu_seconds()
        image = draw(FIRST_SEED + number)
        seconds.append(cpu_seconds() - begun)
        if seconds[0] > SHORT:
            return seconds[0], image
    return statistics.median(seconds[1:]), image
