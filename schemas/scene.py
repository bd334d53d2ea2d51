"""The scene as a user writes it."""

from __future__ import annotations

from typing import Annotated, Any, Literal

from pydantic import BeforeValidator, Field
from pydantic_core import PydanticCustomError

from schemas.base import Closed
from schemas.cameras import Camera
from schemas.display import Display
from schemas.lights import Light
from schemas.materials import Material
from schemas.quantities import Color, Name
from schemas.sampling import Sampling
from schemas.shapes import Shape
from schemas.textures import Texture

BLACK = (0.0, 0.0, 0.0)


def _number(version: Any) -> Any:
    # A literal 1 would take True, which equals it.
    if type(version) is not int:
        raise PydanticCustomError("int_type", "This must be a whole number.")
    return version


class Scene(Closed):
    """A whole scene: camera, shapes, lights, and how they are sampled and shown."""

    version: Annotated[Literal[1], BeforeValidator(_number)] = Field(
        description="The version of the scene language: 1."
    )
    name: Name | None = Field(default=None, description="A name for people; nothing depends on it.")
    camera: Camera = Field(description="Where the picture is taken from.")
    background: Color = Field(default=BLACK, description="Linear RGB where a camera ray hits nothing.")
    ambient: Color = Field(
        default=BLACK, description="Linear RGB of light that comes from everywhere; none by default."
    )
    textures: dict[Name, Texture] = Field(default_factory=dict, description="Textures by name.")
    materials: dict[Name, Material] = Field(default_factory=dict, description="Materials by name.")
    shapes: tuple[Shape, ...] = Field(default=(), description="What is seen, and what casts shadows.")
    lights: tuple[Light, ...] = Field(default=(), description="What shines.")
    sampling: Sampling = Field(default_factory=Sampling, description="How many samples, and where.")
    display: Display = Field(default_factory=Display, description="How the picture file is encoded.")
