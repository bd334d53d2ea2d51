"""The scenes and qualities that are measured."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import renderer
from accuracy.variations import fixed_quality, label
from benchmarks.references import SCENES

if TYPE_CHECKING:
    from schemas.quality import FixedQuality


@dataclass(frozen=True)
class Setting:
    """A study scene at a quality.

    Attributes
    ----------
    scene : str
        `soft` or `chess`.
    pattern : str
        Of the camera samples.
    samples : int
        Camera samples of a pixel.
    light_pattern : str
    light_samples : int
        Points of a light for each camera sample.
    """

    scene: str
    pattern: str
    samples: int
    light_pattern: str
    light_samples: int

    @property
    def quality(self) -> FixedQuality:
        """The quality as a job request has it."""
        return fixed_quality(self.pattern, self.samples, self.light_pattern, self.light_samples)

    @property
    def name(self) -> str:
        """The setting in words."""
        return f"{self.scene}: {label(self.quality)}"

    def plan(self) -> renderer.RenderPlan:
        """Compile the scene."""
        return renderer.compile_scene(SCENES / f"{self.scene}.json", self.quality)


TIMED = (
    Setting("soft", "uniform", 1, "uniform", 64),
    Setting("soft", "uniform", 16, "uniform", 64),
    Setting("chess", "uniform", 16, "uniform", 64),
)
"""What speed is judged by."""

COMPARED = tuple(
    Setting(scene, pattern, samples, light_pattern, light_samples)
    for scene in ("soft", "chess")
    for pattern, samples, light_pattern, light_samples in (
        ("uniform", 1, "uniform", 64),
        ("uniform", 16, "uniform", 64),
        ("rotated", 16, "uniform", 64),
        ("random", 16, "random", 4),
        ("stratified", 16, "stratified", 4),
        ("sobol", 16, "sobol", 4),
        ("sobol", 64, "sobol", 4),
    )
)
"""What accuracy is judged by."""
