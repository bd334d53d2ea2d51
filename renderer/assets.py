"""Files that a scene names: where they come from, and pictures among them."""

import io
import struct
import warnings
from pathlib import Path
from typing import Protocol

import numpy as np
from numpy.typing import NDArray
from PIL import Image

from renderer.warning_filters import changed_filters

MAX_PIXELS = 64 * 1024 * 1024
"""Largest picture that is decoded, by the size that its header states."""

FORMATS = ("PNG", "JPEG", "WEBP", "TIFF", "BMP", "GIF", "PPM")
"""Picture formats that are read."""


class AssetError(ValueError):
    """A file that a scene names cannot be had or used.

    Parameters
    ----------
    message : str
        For the person who wrote the scene.
    pointer : str, optional
        The place in the scene that names the file, where it is known.
    """

    def __init__(self, message: str, pointer: str = "") -> None:
        super().__init__(message)
        self.pointer = pointer


class AssetSource(Protocol):
    """Where the content of a named file comes from."""

    def read(self, name: str) -> bytes:
        """Content of a file; raises KeyError if there is none of that name."""
        ...


class NoAssets:
    """The source of a scene that came without files."""

    def read(self, name: str) -> bytes:
        """Raise KeyError: there are no files."""
        raise KeyError(name)


class FolderAssets:
    """Files in a folder and below it, never outside.

    Parameters
    ----------
    folder : Path
        Symbolic links are followed before the check.
    """

    def __init__(self, folder: Path) -> None:
        self.folder = folder.resolve()

    def read(self, name: str) -> bytes:
        """Content of the file; KeyError if it is missing, no plain file, or outside of the folder."""
        try:
            path = (self.folder / name).resolve()
            if path.is_relative_to(self.folder) and path.is_file():
                return path.read_bytes()
        except (OSError, RuntimeError, ValueError) as error:
            # A loop of links, a name too long or one that no file can have, a file that may not be read.
            raise KeyError(name) from error
        raise KeyError(name)


def image_size(content: bytes, max_pixels: int = MAX_PIXELS) -> tuple[int, int]:
    """Width and height from a picture's header, without decoding it.

    Raises
    ------
    AssetError
        If it is no picture of a known format, or has more than `max_pixels` pixels.
    """
    with _opened(content, max_pixels) as image:
        return image.size


def decode_image(content: bytes, max_pixels: int = MAX_PIXELS) -> NDArray[np.float32]:
    """A picture as stored, (H, W, 3) float32 in 0..1, row 0 on top; grey is repeated, alpha is dropped.

    Raises
    ------
    AssetError
        If it is no picture of a known format, is damaged, or has more than `max_pixels` pixels.
    """
    with _opened(content, max_pixels) as image:
        try:
            return _values(image)
        except _DAMAGE as error:
            raise AssetError("The picture is damaged. Save it again as PNG or JPEG.") from error


_DAMAGE = (OSError, SyntaxError, ValueError, EOFError, LookupError, TypeError, struct.error)
"""What Pillow raises for content that makes no sense, depending on the format."""


def _values(image: Image.Image) -> NDArray[np.float32]:
    with changed_filters():
        warnings.simplefilter("ignore")
        if image.mode in {"I;16", "I;16B", "I"}:
            grey = np.asarray(image, dtype=np.float32) / np.float32(65535)
            return np.repeat(grey[:, :, None], 3, axis=2)
        return np.asarray(image.convert("RGB"), dtype=np.float32) / np.float32(255)


def _opened(content: bytes, max_pixels: int) -> Image.Image:
    try:
        with changed_filters():
            warnings.simplefilter("ignore")
            image = Image.open(io.BytesIO(content), formats=FORMATS)
    except Image.DecompressionBombError as error:
        raise AssetError(
            f"The picture has more than the {max_pixels} pixels allowed. Make it smaller."
        ) from error
    except _DAMAGE as error:
        raise AssetError(f"This is no picture that can be read. Use one of {', '.join(FORMATS)}.") from error
    width, height = image.size
    if width * height > max_pixels:
        image.close()
        raise AssetError(
            f"The picture has {width} x {height} pixels, more than the {max_pixels} allowed. Make it smaller."
        )
    return image
