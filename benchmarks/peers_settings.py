"""What the compared renderers are asked for: one list each, from cheap to dear."""

from __future__ import annotations

from typing import TYPE_CHECKING, Literal, TypeAlias

from benchmarks.povray_pictures import PovraySetting
from benchmarks.povray_scene import LightGrid
from schemas.quality import FixedQuality, TargetQuality
from schemas.sampling import Antialiasing, LightSampling

if TYPE_CHECKING:
    from schemas.quality import Quality

_Pattern: TypeAlias = Literal["center", "uniform", "rotated", "sobol"]
_LightPattern: TypeAlias = Literal["uniform", "sobol"]

SCENES = ("soft", "chess", "normal_texturing", "lamp", "shell")
"""References whose scenes are compared, all 512 x 512."""

TARGETS_255 = (255 / 64, 255 / 128, 1.0, 0.5, 0.25)
"""Errors to reach, in units of 1/255: from a quick look to less than 8 bits can tell."""


def fixed(pattern: _Pattern, samples: int, light: _LightPattern, points: int) -> FixedQuality:
    """Write a quality of exactly these camera samples and light points."""
    return FixedQuality(
        mode="fixed",
        antialiasing=Antialiasing(pattern=pattern, samples=samples),
        light=LightSampling(pattern=light, samples=points),
    )


_FIXED = (
    fixed("center", 1, "uniform", 16),
    fixed("rotated", 4, "uniform", 16),
    fixed("rotated", 4, "uniform", 64),
    fixed("sobol", 4, "sobol", 4),
    fixed("rotated", 9, "uniform", 36),
    fixed("rotated", 16, "uniform", 16),
    fixed("rotated", 16, "uniform", 64),
    fixed("sobol", 16, "sobol", 4),
    fixed("sobol", 24, "sobol", 4),
    fixed("sobol", 36, "sobol", 4),
    fixed("sobol", 64, "sobol", 4),
    fixed("sobol", 128, "sobol", 4),
)

_TARGETS = tuple(TargetQuality(mode="target", error=4 / 255 * 2 ** (-step / 2)) for step in range(10))
"""From 4/255 to 0.18/255: what is asked for and what comes out are not quite the same."""

PENUMBRA: tuple[tuple[Quality, ...], ...] = (_TARGETS, _FIXED)
"""Ways to ask for a picture, each from cheap to dear."""

MITSUBA = (4, 16, 64, 256)
"""Multi-jittered samples a pixel, each with one light point."""


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


def label(quality: Quality) -> str:
    """A quality of ours in a few words."""
    if isinstance(quality, TargetQuality):
        return f"target {255 * quality.error:.2g}/255"
    camera, light = quality.antialiasing, quality.light
    assert camera is not None
    assert light is not None
    return f"{camera.pattern} {camera.samples} x {light.pattern} {light.samples}"
