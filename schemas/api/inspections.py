"""Requests and results of ``POST /v1/traces``, and explanations of a job's pixels."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import Field

from schemas.base import Closed, Message
from schemas.quantities import WHOLE, Number, RayDirection, RayOrigin
from schemas.scene import Scene

Row = tuple[Number, Number, Number]


class TraceRequest(Closed):
    """The body of ``POST /v1/traces``: ray i starts at origins[i] and runs along directions[i]."""

    scene: Scene = Field(description="The scene that the rays are cast into.")
    origins: tuple[RayOrigin, ...] = Field(description="Where each ray starts, scene units.")
    directions: tuple[RayDirection, ...] = Field(
        description="Direction of each ray, of any length; its largest component is from 1e-200 to 1e200."
    )


class TraceAnswer(Message):
    """One entry for each ray. A miss has null in `t`, `position`, `normal` and `uv`, and -1 in `shape`.

    ``t`` counts in units of the direction given, whatever its length. ``normal`` is the geometric unit
    normal on the side of the ray's origin. ``visibility`` has one number for each light.
    """

    t: tuple[float | None, ...] = Field(description="Distance in units of the direction.")
    position: tuple[Row | None, ...] = Field(description="Position of the hit, scene units.")
    normal: tuple[Row | None, ...] = Field(description="Geometric normal there.")
    uv: tuple[tuple[float, float] | None, ...] = Field(description="Texture coordinates there.")
    shape: tuple[int, ...] = Field(description="Index into the scene's shapes, or -1 for a miss.")
    primitive: tuple[int, ...] = Field(description="Triangle of a mesh, or 0.")
    visibility: tuple[tuple[float, ...], ...] = Field(
        description="Share of each light's points that are visible from the hit."
    )


Triple = tuple[float, float, float]
Place = Annotated[int, Field(strict=True, ge=0), WHOLE]

RayKind = Literal["camera", "mirror", "reflection", "refraction"]


class InspectionRequest(Closed):
    """A pixel: column and row, counted from 0 at the upper left."""

    x: Place = Field(description="Column.")
    y: Place = Field(description="Row, from the top.")


class Part(Message):
    """A part of the scene: its pointer and name."""

    pointer: str = Field(description="JSON Pointer into the scene, or over HTTP into the request of the job.")
    name: str | None = Field(description="Its name, if it has one.")


class Blocker(Part):
    """A shape between a point and a light."""

    shape: int = Field(ge=0, description="Index into the scene's shapes.")
    points: int = Field(ge=1, description="Points of the light that it blocks first.")


class InspectedLight(Message):
    """One light's visibility and contribution at a point.

    `points` is the sum of those visible, `below_horizon` and `blocked`.
    """

    light: int = Field(ge=0, description="Index into the scene's lights.")
    pointer: str = Field(description="JSON Pointer into the scene, or over HTTP into the request of the job.")
    visibility: float = Field(ge=0, le=1, description="Share of its points that are visible.")
    points: int = Field(
        ge=1,
        description="Number of tested points: those of a fixed quality, 64 with target quality.",
    )
    below_horizon: int = Field(
        ge=0, description="Points behind the surface, or all if the light shines the other way."
    )
    blocked: int = Field(ge=0, description="Points that a shape hides.")
    blockers: tuple[Blocker, ...] = Field(
        description="The shapes that block first, the one that blocks most points first."
    )
    cosine: float = Field(
        description="Cosine of the angle between the shading normal and the direction to the light's centre."
    )
    turned_away: bool = Field(
        description="Whether the light shines to one side only, and the point is on the other, or into a "
        "cone that does not reach the point."
    )
    diffuse: Triple = Field(description="Linear RGB that the diffuse term adds.")
    specular: Triple = Field(description="Linear RGB that the highlight adds.")
    unblocked: Triple = Field(description="Linear RGB that the light would add if no shape blocked it.")


class InspectedSurface(Message):
    """A hit of a ray with a shape."""

    shape: int = Field(ge=0, description="Index into the scene's shapes.")
    part: Part = Field(description="The shape in the request.")
    primitive: int = Field(ge=0, description="Triangle of a mesh, or 0.")
    t: float = Field(description="Distance from the ray's origin, scene units.")
    position: Triple = Field(description="Scene units.")
    uv: tuple[float, float] = Field(description="Texture coordinates.")
    normal: Triple = Field(description="Geometric normal of length 1, on the side of the ray's origin.")
    shading_normal: Triple = Field(description="The normal that shading uses.")
    material: Part = Field(description="The material in the request.")
    texture: Part | None = Field(description="The texture, if the colour comes from one.")
    color: Triple = Field(
        description="Linear RGB of the surface: the material's colour, or the texture's value."
    )
    ambient: Triple = Field(description="Linear RGB that ambient light adds.")
    lights: tuple[InspectedLight, ...] = Field(description="One for each light of the scene, in its order.")


class InspectedRay(Message):
    """A ray, what it hits, and the rays that continue from there.

    `radiance` is that of the place itself: for a surface, the sum of `ambient` and of every light's `diffuse`
    and `specular`, otherwise the colour of the light or background. The pixel is the sum of `weight` times
    `radiance` over all rays.
    """

    kind: RayKind = Field(description="Where the ray comes from.")
    weight: float = Field(ge=0, description="Share of `radiance` that reaches the camera.")
    origin: Triple = Field(description="Scene units.")
    direction: Triple = Field(description="Direction of length 1.")
    surface: InspectedSurface | None = Field(description="Its hit; null if it hits no shape.")
    light: Part | None = Field(description="The light that it hits, if any.")
    radiance: Triple = Field(description="Linear RGB.")
    rays: tuple[InspectedRay, ...] = Field(description="Mirrored, reflected and refracted rays.")


class Reason(Message):
    """A sentence about why the pixel looks as it does."""

    code: str = Field(
        description="A word for programs, such as `blocked`, `faces_away`, `ambient_only`, `black_material`."
    )
    text: str = Field(description="A sentence.")
    pointers: tuple[str, ...] = Field(
        description="JSON Pointers to the parts of the request that it concerns."
    )


class Inspection(Message):
    """An explanation of a pixel: the first hit of its central ray, and the parts of its radiance."""

    x: int = Field(description="Column.")
    y: int = Field(description="Row, from the top.")
    color: Triple = Field(
        description="Linear RGB of this one ray. The pixel of the picture is the mean of all its samples."
    )
    reasons: tuple[Reason, ...] = Field(
        description="Why the pixel looks as it does, the most important reason first."
    )
    ray: InspectedRay = Field(description="What the ray hits.")
    complete: bool = Field(
        description="False if more rays continue than are listed; then the rays add up to less than `color`."
    )
