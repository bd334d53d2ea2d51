"""Options of commands that render: another size, or a part of the picture, without editing the scene."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Annotated, Any

import typer

from service.cli.errors import CommandError

if TYPE_CHECKING:
    from schemas.cameras import Camera

PANEL = "Size, in place of the camera's"
MOST_PIXELS = 1 << 16
"""Largest side, that of the scene language."""


def _parsed_crop(text: str) -> tuple[int, ...]:
    parts = text.split(",")
    if len(parts) != 4 or not all(part.strip().isdecimal() for part in parts):
        raise CommandError("--crop must be X,Y,WIDTH,HEIGHT in whole pixels, like 100,50,64,64.")
    crop = tuple(map(int, parts))
    if max(crop) > MOST_PIXELS:
        raise CommandError(
            f"--crop {text} is outside of any picture: a side has at most {MOST_PIXELS} pixels."
        )
    return crop


def _option(*names: str, text: str, **more: Any) -> Any:
    return typer.Option(*names, help=text, rich_help_panel=PANEL, show_default=False, **more)


@dataclass(frozen=True, slots=True)
class SizeOptions:
    """The options that choose a size and a part of the picture."""

    width: Annotated[
        int | None,
        _option(text="Columns, pixels; without --height in proportion.", min=1, max=MOST_PIXELS),
    ] = None
    height: Annotated[
        int | None, _option(text="Rows, pixels; without --width in proportion.", min=1, max=MOST_PIXELS)
    ] = None
    scale: Annotated[
        float | None,
        _option(text="Columns and rows times this, like 0.25 for a quick look.", min=1e-4, max=1e4),
    ] = None
    crop: Annotated[
        Any,
        _option(
            text="Only this part of the picture at that size, pixels from the upper left.",
            parser=_parsed_crop,
            metavar="X,Y,W,H",
        ),
    ] = None

    def __bool__(self) -> bool:
        """Whether any of them is given."""
        return any((self.width, self.height, self.scale, self.crop))

    def resized(self, camera: Camera) -> Camera:
        """The camera with the size and the crop of the options.

        Raises
        ------
        CommandError
            The options contradict each other, or choose more pixels than are allowed.
        """
        if self.scale is not None and (self.width is not None or self.height is not None):
            raise CommandError("--scale chooses width and height. Leave out --width and --height.")
        from pydantic import ValidationError

        from schemas.cameras import Camera
        from schemas.limits import limits_in_force

        width, height = self._size(camera)
        if max(width, height) > MOST_PIXELS:
            raise CommandError(
                f"That makes {width} x {height} pixels; sides have at most {MOST_PIXELS}. Make it smaller."
            )
        sized = camera.resized(width, height)
        crop = {} if self.crop is None else {"crop": self.crop}
        try:
            # Validated once more, since a copy is not.
            return Camera.model_validate(
                sized.model_dump(exclude_unset=True) | crop, context=limits_in_force()
            )
        except ValidationError as error:
            raise CommandError(" ".join(item["msg"] for item in error.errors(include_url=False))) from error

    def applied(self, scene: Mapping[str, Any]) -> Mapping[str, Any]:
        """The document of a scene with these options; one whose camera is wrong is returned as it is."""
        from pydantic import ValidationError

        from schemas.cameras import Camera

        try:
            camera = Camera.model_validate(scene.get("camera"))
        except ValidationError:
            return scene
        sized = self.resized(camera)
        changed = {name: getattr(sized, name) for name in ("width", "height", "crop") if getattr(sized, name)}
        return {**scene, "camera": {**scene["camera"], **changed}}

    def _size(self, camera: Camera) -> tuple[int, int]:
        """Columns and rows; one that is not given follows from the other in proportion."""
        width, height = self.width, self.height
        if self.scale is not None:
            width, height = (round(self.scale * side) for side in (camera.width, camera.height))
        if width is None:
            width = camera.width if height is None else round(camera.width * height / camera.height)
        if height is None:
            height = round(camera.height * width / camera.width)
        return max(1, width), max(1, height)
