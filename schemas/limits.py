"""How large a document may be."""

from __future__ import annotations

from dataclasses import dataclass

from pydantic import ValidationInfo
from pydantic_core import PydanticCustomError

MAX_TRIANGLES = 2_000_000
"""Triangles of all meshes of a scene, those in files too: some 400 bytes each while rendering."""


@dataclass(frozen=True, slots=True)
class Limits:
    """Bounds that are checked before any work; a service takes them from its settings."""

    max_body_bytes: int = 16 * 1024 * 1024
    """Length of a document, bytes."""
    max_depth: int = 64
    """Objects and arrays inside each other."""
    max_values: int = 600_000
    """Values in the document, of any kind."""
    max_members: int = 10_000
    """Members of one object."""
    max_shapes: int = 20_000
    """Shapes of a scene."""
    max_triangles: int = 200_000
    """Triangles of a mesh that is written in the scene."""
    max_lights: int = 1_000
    """Lights of a scene."""
    max_materials: int = 10_000
    """Materials of a scene."""
    max_textures: int = 1_000
    """Textures of a scene."""
    max_pixels: int = 4096 * 4096
    """Width times height."""
    max_samples: int = 4096
    """Camera samples a pixel."""
    max_light_samples: int = 4096
    """Light points a camera sample."""


def refuse_above(count: int, info: ValidationInfo, limit: str, things: str) -> None:
    """Refuse a count beyond a limit, where the validation has limits for its context.

    Raises
    ------
    PydanticCustomError
        Names both numbers.
    """
    if isinstance(info.context, Limits) and count > getattr(info.context, limit):
        message = "There are {count} {things}; at most {most} are allowed here."
        context = {"count": count, "things": things, "most": getattr(info.context, limit)}
        raise PydanticCustomError("over_limit", message, context)
