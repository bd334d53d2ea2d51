"""How large a document may be."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class Limits:
    """Bounds that are checked before any work; a service takes them from its settings."""

    max_body_bytes: int = 16 * 1024 * 1024
    """Length of a document, bytes."""
    max_depth: int = 64
    """Objects and arrays inside each other."""
    max_shapes: int = 20_000
    """Shapes of a scene."""
    max_lights: int = 1_000
    """Lights of a scene."""
    max_names: int = 10_000
    """Members of one object, so also materials or textures of a scene."""
    max_pixels: int = 4096 * 4096
    """Width times height."""
    max_samples: int = 4096
    """Camera samples a pixel."""
    max_light_samples: int = 4096
    """Light points a camera sample."""
