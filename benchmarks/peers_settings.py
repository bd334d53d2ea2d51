"""What is compared: scenes, errors, goals, and the settings of each renderer, from cheap to expensive."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING

from accuracy.variations import fixed_quality
from benchmarks.povray_pictures import PovraySetting
from benchmarks.povray_scene import LightGrid
from schemas.quality import TargetQuality

if TYPE_CHECKING:
    from collections.abc import Iterable

    from schemas.quality import Quality

KINDS = {
    "shapes": "shapes and soft shadows",
    "textures": "textures and normal maps",
    "mesh": "meshes",
    "lens": "a thin lens",
}
"""What scenes are compared as, in words."""

SCENES = {
    "soft": "shapes",
    "chess": "shapes",
    "lamp": "shapes",
    "normal_texturing": "textures",
    "textured_room": "textures",
    "shell": "mesh",
    "lens_room": "lens",
}
"""References whose scenes are compared, all 512 x 512, and the kind of each."""

ERRORS_255 = (4.0, 2.0, 1.0, 0.5, 0.25, 0.1)
"""Errors at which renderers are compared, in units of 1/255: from a preview to what no display shows."""

GOALS = {
    "shapes": (1.0, 0.8, 0.5, 0.35, 0.25, 0.15),
    "textures": (1.5, 1.2, 1.0, 1.0, 1.0, 1.0),
    "mesh": (1.5, 1.2, 1.0, 1.0, 1.0, 1.0),
    "lens": (2.0, 1.5, 1.0, 1.0, 1.0, 1.0),
}
"""CPU seconds of target quality over Mitsuba's that we mean to keep within, at each of `ERRORS_255`."""

FIXED_GOAL = 1.05
"""CPU seconds of target quality over those of fixed samples, the same goal for every scene and error."""

PRECISION_GOAL = (0.75, 1.0)
"""True error over the target error, the median over a scene's targets."""


@dataclass(frozen=True)
class Effort:
    """How much is measured.

    Attributes
    ----------
    runs : int
        Timed runs of a setting; the median counts.
    longest : float
        CPU seconds of a run after which nothing finer is tried in the same way.
    thorough : bool
        Whether POV-Ray renders, too, and NumPy's own limit is measured.
    """

    runs: int
    longest: float
    thorough: bool


FULL = Effort(runs=3, longest=15.0, thorough=True)
"""Half an hour for all scenes on two idle cores."""

QUICK = Effort(runs=1, longest=3.0, thorough=False)
"""A minute a scene, to compare a change with."""


REGULAR = (
    fixed_quality("center", 1, "uniform", 4),
    fixed_quality("center", 1, "uniform", 16),
    fixed_quality("uniform", 4, "uniform", 4),
    fixed_quality("rotated", 4, "uniform", 16),
    fixed_quality("uniform", 9, "uniform", 9),
    fixed_quality("rotated", 9, "uniform", 36),
    fixed_quality("rotated", 16, "uniform", 16),
    fixed_quality("rotated", 16, "uniform", 64),
    fixed_quality("rotated", 36, "uniform", 36),
    fixed_quality("rotated", 64, "uniform", 16),
)
SOBOL = tuple(fixed_quality("sobol", samples, "sobol", 4) for samples in (1, 2, 4, 8, 16, 32, 64, 128, 256))

FIXED: tuple[tuple[Quality, ...], ...] = (REGULAR, SOBOL)
"""Ways to ask for fixed samples, each from cheap to expensive."""

COARSER = math.sqrt(2)
"""Beside each error a target this many times as large is rendered: the curve has a point between errors."""


def asked(errors_255: Iterable[float]) -> list[TargetQuality]:
    """Write the targets that show what target quality costs at these errors, the coarsest first.

    Examples
    --------
    >>> from accuracy.variations import label
    >>> [label(quality) for quality in asked([1.0, 4.0])]
    ['target 5.66/255', 'target 4/255', 'target 1.41/255', 'target 1/255']
    """
    errors = sorted((factor * error for error in errors_255 for factor in (1, COARSER)), reverse=True)
    return [TargetQuality(mode="target", error=error / 255) for error in errors]


MITSUBA = (1, 2, 4, 8, 16, 30, 64, 132, 256, 506, 1024)
"""Multi-jittered samples a pixel, each with one light point. The sampler rounds none of these up."""


POVRAY = {
    "soft": (
        PovraySetting(LightGrid(3, "area")),
        PovraySetting(LightGrid(2, "points"), 0.1, 2),
        PovraySetting(LightGrid(3, "points"), 0.1, 2),
        PovraySetting(LightGrid(3, "points"), 0.03, 3),
        PovraySetting(LightGrid(4, "points"), 0.02, 4),
        PovraySetting(LightGrid(5, "points"), 0.02, 4),
        PovraySetting(LightGrid(6, "points"), 0.01, 4),
    ),
    "chess": (
        PovraySetting(LightGrid(2, "area")),
        PovraySetting(LightGrid(2, "points"), 0.1, 2),
        PovraySetting(LightGrid(2, "points"), 0.03, 3),
        PovraySetting(LightGrid(2, "points"), 0.1, 4, method=1),
        PovraySetting(LightGrid(2, "points"), 0.03, 8, method=1),
        PovraySetting(LightGrid(2, "points"), 0.003, 5),
        PovraySetting(LightGrid(2, "points"), 0.001, 6),
    ),
}
"""The scenes that POV-Ray's language can say. Found by trying some forty settings of each."""
