"""The comparison with Mitsuba: scenes, errors, and the settings of both, from cheap to expensive."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from accuracy.variations import fixed_quality
from schemas.quality import TargetQuality

if TYPE_CHECKING:
    from collections.abc import Iterable

SCENES = {
    "soft": "shapes and soft shadows",
    "chess": "shapes and soft shadows",
    "lamp": "shapes and soft shadows",
    "normal_texturing": "textures and normal maps",
    "textured_room": "textures and normal maps",
    "shell": "meshes",
    "lens_room": "a thin lens",
}
"""References whose scenes are compared, all 512 x 512, and the kind of each."""

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


def asked(errors_255: Iterable[float]) -> list[TargetQuality]:
    """Targets that show what target quality costs at these errors and between them, the coarsest first."""
    errors = sorted((factor * error for error in errors_255 for factor in (1, math.sqrt(2))), reverse=True)
    return [TargetQuality(mode="target", error=error / 255) for error in errors]
