"""The camera: its position, view, lens and size in pixels."""

from __future__ import annotations

from typing import Annotated

from pydantic import Field, ValidationInfo, field_validator
from pydantic_core import PydanticCustomError

from schemas.base import Closed
from schemas.limits import refuse_above
from schemas.quantities import LARGEST, SMALLEST, Count, Direction, Point, Size, difference, length

FieldOfView = Annotated[float, Field(strict=True, gt=0, lt=180, allow_inf_nan=False)]

LensRadius = Annotated[float, Field(strict=True, ge=0, le=LARGEST, allow_inf_nan=False)]


class Camera(Closed):
    """A pinhole camera, or one with a thin lens.

    With f = unit(look_at - position), r = unit(f x up), u = r x f and h = tan(vertical_fov / 2), the ray
    through column i, row j from the top and sub-pixel (a, b) in [0, 1) has the direction
    f + r h (width / height) (2 (i + a) / width - 1) + u h (1 - 2 (j + b) / height).
    """

    position: Point = Field(description="Position of the camera, scene units.")
    look_at: Point = Field(description="The point in the middle of the picture, scene units.")
    up: Direction = Field(
        default=(0.0, 1.0, 0.0),
        description="The direction that is up in the picture, of any length. If it is parallel to the view, "
        "the world axis farthest from the view direction is used, with a warning.",
    )
    vertical_fov: FieldOfView = Field(
        default=40.0, description="Angle of view from bottom to top, degrees, between 0 and 180 exclusive."
    )
    focal_length: Size = Field(
        default=1.0,
        description="Distance of the virtual screen, scene units. It does not change the picture of a "
        "pinhole.",
    )
    lens_radius: LensRadius = Field(
        default=0.0,
        description="Radius of a thin lens, scene units; 0 is a pinhole. A lens blurs what is nearer or "
        "farther than the focus. Points on the lens are random with antialiasing `random`, otherwise "
        "scrambled Sobol points, shuffled for each pixel.",
    )
    focus_distance: Size | None = Field(
        default=None,
        validate_default=True,
        description="Distance of the plane in focus along the view, scene units; by default that of "
        "`look_at`.",
    )
    width: Count = Field(default=512, description="Columns, pixels, 1 to 65536.")
    height: Count = Field(default=512, validate_default=True, description="Rows, pixels, 1 to 65536.")

    @field_validator("look_at")
    @classmethod
    def _elsewhere(cls, look_at: Point, info: ValidationInfo) -> Point:
        if look_at == info.data.get("position"):
            raise PydanticCustomError(
                "no_view", "'look_at' equals 'position', so the camera looks nowhere. Move one of the two."
            )
        return look_at

    @field_validator("focus_distance")
    @classmethod
    def _in_focus(cls, focus_distance: float | None, info: ValidationInfo) -> float | None:
        known = info.data
        near = {"position", "look_at"} <= known.keys() and length(
            difference(known["look_at"], known["position"])
        ) < SMALLEST
        if focus_distance is None and near and known.get("lens_radius"):
            raise PydanticCustomError(
                "no_focus",
                "Without 'focus_distance' the lens is focused on 'look_at', which is nearer to 'position' "
                "than 1e-100. Give a 'focus_distance', or move one of the two.",
            )
        return focus_distance

    @field_validator("height")
    @classmethod
    def _not_too_many_pixels(cls, height: int, info: ValidationInfo) -> int:
        refuse_above(height * info.data.get("width", 1), info, "max_pixels", "pixels, width x height")
        return height
