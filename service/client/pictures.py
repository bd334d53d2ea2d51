"""Image files of a job: read as arrays and images, and written in one step."""

from __future__ import annotations

import errno
import io
import os
import secrets
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal

import httpx2
import numpy as np
import numpy.typing as npt

from service.client.errors import UnexpectedAnswerError

if TYPE_CHECKING:
    from PIL.Image import Image

PictureKind = Literal["png", "npy", "exr"]
KINDS: dict[str, PictureKind] = {".png": "png", ".npy": "npy", ".exr": "exr"}
PNG = b"\x89PNG\r\n\x1a\n"


@dataclass(frozen=True, slots=True)
class Picture:
    """An image file as the service sent it. A notebook shows one that is a PNG file.

    Attributes
    ----------
    content
        The bytes of the file.
    share
        The rendered share, 0 to 1.
    """

    content: bytes = field(repr=False)
    share: float

    @property
    def complete(self) -> bool:
        """Whether this is the final image."""
        return self.share >= 1.0

    def array(self) -> npt.NDArray[Any]:
        """The pixels of a ``.npy`` picture or layer.

        Returns
        -------
        numpy.ndarray
            Of a picture linear RGB, shape (height, width, 3), float32, row 0 at the top.

        Raises
        ------
        UnexpectedAnswerError
            The content is not an array file.
        """
        try:
            pixels: npt.NDArray[Any] = np.load(io.BytesIO(self.content), allow_pickle=False)
        except (ValueError, EOFError) as error:
            raise UnexpectedAnswerError("The server did not send an array file.") from error
        return pixels

    def pillow(self) -> Image:
        """The image of a ``.png`` picture, RGB with 8 bits as displayed.

        Raises
        ------
        UnexpectedAnswerError
            The content is not a PNG file.
        """
        # Arrays and files need no Pillow.
        from PIL import Image, UnidentifiedImageError  # noqa: PLC0415

        try:
            image = Image.open(io.BytesIO(self.content), formats=["PNG"])
            image.load()
        except (UnidentifiedImageError, OSError) as error:
            raise UnexpectedAnswerError("The server did not send a PNG file.") from error
        return image

    def _repr_png_(self) -> bytes | None:
        return self.content if self.content.startswith(PNG) else None


def read_picture(answer: httpx2.Response) -> Picture:
    """A picture from its answer; without ``X-Progress`` it is final."""
    return Picture(answer.content, float(answer.headers.get("X-Progress", "1")))


def kind_of(path: str | os.PathLike[str]) -> PictureKind:
    """The kind of picture that a file of this name holds.

    Raises
    ------
    ValueError
        The name has another ending.
    """
    kind = KINDS.get(Path(path).suffix.lower())
    if kind is None:
        raise ValueError(f"{os.fspath(path)} must end in {', '.join(KINDS)}: the ending chooses the format.")
    return kind


def write(path: str | os.PathLike[str], content: bytes) -> Path:
    """Write a file in one step: readers see the old file or the new one, never a part of it.

    Raises
    ------
    OSError
        It cannot be written; FileNotFoundError names the folder that is missing.
    """
    target = Path(path)
    if not target.parent.is_dir():
        raise FileNotFoundError(errno.ENOENT, "There is no such folder", str(target.parent))
    # Unlike a file of tempfile this one has the rights that the process gives to new files.
    temporary = target.with_name(f".{target.name}.{secrets.token_hex(4)}")
    try:
        with temporary.open("xb") as file:
            file.write(content)
        temporary.replace(target)
    finally:
        temporary.unlink(missing_ok=True)
    return target
