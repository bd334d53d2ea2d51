"""The language of scenes, jobs, tiles, plans and problems."""

from typing import TYPE_CHECKING

from schemas.exports import lazy_names

if TYPE_CHECKING:
    from schemas.errors import Problem, SceneError
    from schemas.limits import Limits
    from schemas.quality import FixedQuality, TargetQuality
    from schemas.scene import Scene

__all__ = ["FixedQuality", "Limits", "Problem", "Scene", "SceneError", "TargetQuality"]

HOMES = {
    "errors": ("Problem", "SceneError"),
    "limits": ("Limits",),
    "quality": ("FixedQuality", "TargetQuality"),
    "scene": ("Scene",),
}
"""Modules, each loaded on the first use of one of its names: catching an error loads no models."""

__getattr__, __dir__ = lazy_names(__name__, HOMES)
