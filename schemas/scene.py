"""The scene as a user writes it."""

from __future__ import annotations

from collections.abc import Mapping, Sized
from typing import Annotated, Any, Literal, Self

from pydantic import (
    BeforeValidator,
    Field,
    ModelWrapValidatorHandler,
    ValidationError,
    ValidationInfo,
    field_validator,
    model_validator,
)
from pydantic_core import ErrorDetails, InitErrorDetails, PydanticCustomError

from schemas.base import Closed
from schemas.cameras import Camera
from schemas.display import Display
from schemas.lights import Light
from schemas.limits import refuse_above
from schemas.materials import Material
from schemas.quantities import Color, Name, whole
from schemas.references import wrong_names
from schemas.sampling import Sampling
from schemas.sentences import BUILT_IN
from schemas.shapes import Shape
from schemas.textures import Texture

# Putting errors together costs microseconds for each. Beyond so many, wrong names wait for the next try.
_MANY = 1000

BLACK = (0.0, 0.0, 0.0)


def _number(version: Any) -> Any:
    # A literal 1 would take True, which equals it.
    number = whole(version)
    if type(number) is not int:
        raise PydanticCustomError("not_a_choice", "This must be 1, without quotes.")
    return number


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
    shapes: tuple[Shape, ...] = Field(
        default=(),
        description="What is seen, and what casts shadows. Where flat ones overlap in one plane, the first "
        "is seen.",
    )
    lights: tuple[Light, ...] = Field(default=(), description="What shines.")
    sampling: Sampling = Field(default_factory=Sampling, description="How many samples, and where.")
    display: Display = Field(default_factory=Display, description="How the picture file is encoded.")

    @field_validator("shapes", "lights", "materials", "textures", mode="before")
    @classmethod
    def _not_too_many(cls, items: Any, info: ValidationInfo) -> Any:
        if isinstance(items, Sized):
            refuse_above(len(items), info, f"max_{info.field_name}", f"{info.field_name} in one scene")
        return items

    @model_validator(mode="wrap")
    @classmethod
    def _names_defined(cls, scene: Any, handler: ModelWrapValidatorHandler[Self]) -> Self:
        # Names are checked on the raw scene, so that a wrong number elsewhere does not hide a wrong name.
        wrong = wrong_names(scene) if isinstance(scene, Mapping) else []
        try:
            checked = handler(scene)
        except ValidationError as error:
            if not wrong or error.error_count() > _MANY:
                raise
            wrong = [*map(_again, error.errors(include_url=False)), *wrong]
        if wrong:
            raise ValidationError.from_exception_data(cls.__name__, wrong, hide_input=True)
        return checked


def _again(error: ErrorDetails) -> InitErrorDetails:
    """Make an error that can be raised together with others."""
    kind, context = error["type"], error.get("ctx", {})
    made = kind if kind in BUILT_IN else PydanticCustomError(kind, error["msg"], context)
    return InitErrorDetails(type=made, loc=error["loc"], input=error["input"], ctx=context)
