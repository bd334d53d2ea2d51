"""Limits on scenes and files, set by `Limits` or ``PENUMBRA_LIMITS__<NAME>``."""

from __future__ import annotations

import os
from collections.abc import Mapping
from dataclasses import asdict, dataclass, fields

from pydantic import ValidationInfo
from pydantic_core import PydanticCustomError

PREFIX = "PENUMBRA_LIMITS__"
"""Prefix of environment variables that set limits, of a service and of rendering without one."""


class LimitsError(ValueError):
    """A limit has no such name, or no such value."""


@dataclass(frozen=True, slots=True)
class Limits:
    """Bounds that are checked before any work; a service takes them from its settings.

    Raises
    ------
    LimitsError
        One of them is not a whole number, or below 1.
    """

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
    max_mesh_triangles: int = 2_000_000
    """Triangles of all meshes of a scene, those in files too: some 400 bytes each while rendering."""
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
    max_image_pixels: int = 64 * 1024 * 1024
    """Pixels of a picture file, a texture or one that is compared: a few bytes may unpack to any number."""

    def __post_init__(self) -> None:
        """Refuse values that are not whole numbers of 1 or more."""
        for name, value in asdict(self).items():
            if type(value) is not int or value < 1:
                raise LimitsError(f"{name} must be a whole number, 1 or more, not {value!r}")

    def variables(self) -> dict[str, str]:
        """The same as environment variables, for worker processes."""
        return {variable_of(name): str(value) for name, value in asdict(self).items()}


def variable_of(limit: str) -> str:
    """Name of the variable that sets a limit."""
    return PREFIX + limit.upper()


def limits_in_force(environment: Mapping[str, str] = os.environ) -> Limits:
    """The limits of this process: by its environment, else the defaults.

    Raises
    ------
    LimitsError
        A variable names no limit, or has no whole number of 1 or more.
    """
    known = {variable_of(field.name): field.name for field in fields(Limits)}
    given: dict[str, int] = {}
    for variable, text in environment.items():
        # As settings of a service: in capitals or not.
        if not variable.upper().startswith(PREFIX):
            continue
        if variable.upper() not in known:
            raise LimitsError(f"{variable} names no limit. There are {', '.join(known)}.")
        if not text.strip().isdecimal() or int(text) < 1:
            raise LimitsError(f"{variable} must be a whole number, 1 or more, not {text!r}.")
        given[known[variable.upper()]] = int(text)
    return Limits(**given)


def how_to_raise(limit: str) -> str:
    """Say what raises a limit, the last sentence of the message that it was exceeded."""
    return f"{variable_of(limit)} raises this limit."


def refuse_above(count: int, info: ValidationInfo, limit: str, things: str) -> None:
    """Refuse a count beyond a limit, where the validation has limits for its context.

    Raises
    ------
    PydanticCustomError
        Names both numbers, and how to raise the limit.
    """
    if isinstance(info.context, Limits) and count > getattr(info.context, limit):
        message = "There are {count} {things}; at most {most} are allowed here. {cure}"
        context = {"count": count, "things": things, "most": getattr(info.context, limit)}
        raise PydanticCustomError("over_limit", message, context | {"cure": how_to_raise(limit)})
