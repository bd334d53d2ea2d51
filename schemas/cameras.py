"""The camera: its position, view, lens and size in pixels."""

from __future__ import annotations

from typing import Annotated

from pydantic import Field, ValidationInfo, field_validator
from pydantic_core import PydanticCustomError

from schemas.base import Closed
from schemas.limits import refuse_above
from schemas.quantities import (
    MAX_COORDINATE,
    MIN_SIZE,
    Count,
    Direction,
    Index,
    Point,
    Size,
    difference,
    length,
)

FieldOfView = Annotated[float, Field(strict=True, gt=0, lt=180, allow_inf_nan=False)]

LensRadius = Annotated[float, Field(strict=True, ge=0, le=MAX_COORDINATE, allow_inf_nan=False)]


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
    crop: tuple[Index, Index, Index, Index] | None = Field(
        default=None,
        description="The part of the picture to render, `[x, y, width, height]` in pixels from the upper "
        "left; by default all of it. Its pixels are those of the whole picture.",
    )

    @property
    def picture_size(self) -> tuple[int, int]:
        """Columns and rows of the picture that is rendered: those of the crop, if there is one."""
        return self.crop[2:] if self.crop else (self.width, self.height)

    def resized(self, width: int, height: int) -> Camera:
        """The same view at another size; a crop shows the same part, to whole pixels around it."""
        update: dict[str, object] = {"width": width, "height": height}
        if self.crop:
            across = _stretched(self.crop[0], self.crop[2], width, self.width)
            down = _stretched(self.crop[1], self.crop[3], height, self.height)
            update["crop"] = (across[0], down[0], across[1], down[1])
        return self.model_copy(update=update)

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
        ) < MIN_SIZE
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

    @field_validator("crop")
    @classmethod
    def _inside(
        cls, crop: tuple[int, int, int, int] | None, info: ValidationInfo
    ) -> tuple[int, int, int, int] | None:
        width, height = (info.data.get(side, 1 << 32) for side in ("width", "height"))
        if crop and not (crop[2] and crop[3]):
            raise PydanticCustomError(
                "crop_empty",
                "The crop [x, y, width, height] has no pixels. Its width and height are 1 or more.",
            )
        if crop and (crop[0] + crop[2] > width or crop[1] + crop[3] > height):
            raise PydanticCustomError(
                "crop_outside",
                "The crop [x, y, width, height] ends at column {right} and row {bottom}, but the picture has "
                "{width} x {height} pixels. Make it smaller, or move it.",
                {"right": crop[0] + crop[2], "bottom": crop[1] + crop[3], "width": width, "height": height},
            )
        return crop


def _stretched(first: int, count: int, size: int, from_size: int) -> tuple[int, int]:
    """First pixel and number of pixels of a part of a side, `first` to `first + count`, at another size."""
    start = first * size // from_size
    return start, max(1, -(-(first + count) * size // from_size) - start)
