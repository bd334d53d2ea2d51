"""The image of a job, whole or as far as it is rendered."""

from __future__ import annotations

import io
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any, Literal

import httpx2
import numpy as np
import numpy.typing as npt

from service.client.errors import UnexpectedAnswerError

if TYPE_CHECKING:
    from PIL.Image import Image

PictureKind = Literal["png", "npy", "exr"]
PNG = b"\x89PNG\r\n\x1a\n"


@dataclass(frozen=True, slots=True)
class Picture:
    """An image file as the service sent it. A notebook shows one that is a PNG file.

    Attributes
    ----------
    content
        The bytes of the file.
    share
        How much of it is rendered, 0 to 1.
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
            raise UnexpectedAnswerError("The server sent something else than an array file.") from error
        return pixels

    def pillow(self) -> Image:
        """The image of a ``.png`` picture, RGB with 8 bits as displayed.

        Raises
        ------
        UnexpectedAnswerError
            The content is not a PNG file.
        """
        # Whoever takes arrays or files needs no Pillow.
        from PIL import Image, UnidentifiedImageError  # noqa: PLC0415

        try:
            image = Image.open(io.BytesIO(self.content), formats=["PNG"])
            image.load()
        except (UnidentifiedImageError, OSError) as error:
            raise UnexpectedAnswerError("The server sent something else than a PNG file.") from error
        return image

    def _repr_png_(self) -> bytes | None:
        return self.content if self.content.startswith(PNG) else None


def read_picture(answer: httpx2.Response) -> Picture:
    """A picture from its answer; without ``X-Progress`` it is final."""
    return Picture(answer.content, float(answer.headers.get("X-Progress", "1")))
