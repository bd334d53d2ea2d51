"""The image of a job, whole or as far as it is rendered."""

from __future__ import annotations

import io
from dataclasses import dataclass
from typing import Any, Literal

import httpx2
import numpy as np
import numpy.typing as npt

from service.client.errors import UnexpectedAnswerError

PictureKind = Literal["png", "npy", "exr"]


@dataclass(frozen=True, slots=True)
class Picture:
    """An image file as the service sent it.

    Attributes
    ----------
    content
        The bytes of the file.
    share
        How much of it is rendered, 0 to 1.
    """

    content: bytes
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


def read_picture(answer: httpx2.Response) -> Picture:
    """A picture from its answer; without ``X-Progress`` it is final."""
    return Picture(answer.content, float(answer.headers.get("X-Progress", "1")))
