"""Textures: an image file, or a checker board."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import Field

from schemas.base import Closed, chosen_by, tag
from schemas.quantities import MAX_COORDINATE, Asset, Color

Repeat = Annotated[float, Field(strict=True, gt=0, le=MAX_COORDINATE, allow_inf_nan=False)]


class ImageTexture(Closed):
    """A texture from an image file: PNG, JPEG, WEBP, TIFF, BMP, GIF, PPM, PFM, Radiance HDR or OpenEXR.

    Row 0 of the picture, upright by its EXIF orientation, is v = 1; texel centres are at (i + 0.5) / width.
    All its bits are read, and alpha, colour profiles and gamma are not.
    """

    type: Literal["image"]
    asset: Asset = Field(
        description="On the command line a path relative to the scene file, never outside its folder; over "
        "HTTP `sha256:` and the 64 hexadecimal digits of an uploaded asset."
    )
    encoding: Literal["srgb", "linear"] = Field(
        default="srgb",
        description="How the file stores colours: `srgb` for pictures, `linear` for data and for files of "
        "floating-point numbers, whose colours may be above 1. Normal, bump and displacement maps are always "
        "read as `linear`.",
    )
    filter: Literal["nearest", "bilinear", "mipmap"] = Field(
        default="bilinear",
        description="`nearest` texel, `bilinear` between four texels, or `mipmap`: trilinear, in smaller "
        "versions of the image where one texel is as long as the longer side of the area that a sample "
        "covers. Each version is the box mean of the one before, in linear light. Bump and displacement maps "
        "read `mipmap` as `bilinear`.",
    )
    wrap: Literal["clamp", "repeat", "mirror"] = Field(
        default="clamp",
        description="What lies outside 0 to 1: the border texel, the image again, or its mirror image.",
    )


class CheckerTexture(Closed):
    """A checkerboard of repeat[0] x repeat[1] fields over uv from 0 to 1.

    A point has the colour `even` where floor(u * repeat[0]) + floor(v * repeat[1]) is even, else `odd`.
    """

    type: Literal["checker"]
    even: Color = Field(default=(0.9, 0.9, 0.9), description="Linear RGB of the field at uv = (0, 0).")
    odd: Color = Field(default=(0.1, 0.1, 0.1), description="Linear RGB of its neighbours.")
    repeat: tuple[Repeat, Repeat] = Field(
        default=(8.0, 8.0), description="Number of fields along u and v from 0 to 1, more than 0."
    )
    filter: Literal["none", "box"] = Field(
        default="none",
        description="`none`: the colour at a point. `box`: the exact mean over a box in u and v around the "
        "area that a sample covers on the surface.",
    )


Texture = Annotated[
    Annotated[ImageTexture, tag(ImageTexture)] | Annotated[CheckerTexture, tag(CheckerTexture)],
    chosen_by({"image": (ImageTexture,), "checker": (CheckerTexture,)}),
]
