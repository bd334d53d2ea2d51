"""Rays sent to ``POST /v1/traces`` and what they hit."""

from __future__ import annotations

from pydantic import Field

from schemas.base import Closed
from schemas.jobs import Message
from schemas.quantities import Number, RayDirection, RayOrigin
from schemas.scene import Scene

Row = tuple[Number, Number, Number]


class TraceRequest(Closed):
    """The body of ``POST /v1/traces``: ray i starts at origins[i] and runs along directions[i]."""

    scene: Scene
    origins: tuple[RayOrigin, ...]
    directions: tuple[RayDirection, ...]


class TraceAnswer(Message):
    """One entry for each ray. A ray that hits nothing has null in t, position, normal and uv and shape -1.

    ``t`` counts in units of the direction given, whatever its length. ``normal`` is the geometric unit
    normal on the side of the ray's origin. ``visibility`` has one number for each light.
    """

    t: tuple[float | None, ...]
    position: tuple[Row | None, ...]
    normal: tuple[Row | None, ...]
    uv: tuple[tuple[float, float] | None, ...]
    shape: tuple[int, ...] = Field(description="Index into the scene's shapes, or -1.")
    primitive: tuple[int, ...] = Field(description="Triangle of a mesh, or 0.")
    visibility: tuple[tuple[float, ...], ...] = Field(description="Share of each light seen from the hit.")
