"""Pictures as files."""

import io
import os
import tempfile
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from PIL import Image

from renderer.errors import ImageFileError
from renderer.images.colors import srgb_from_linear
from renderer.images.exr import decode_exr, encode_exr, require_exr
from schemas.scene import Display

__all__ = [
    "SUFFIXES",
    "decode_exr",
    "displayed",
    "encode",
    "encode_exr",
    "encode_layer",
    "encode_npy",
    "encode_png",
    "encode_thumbnail",
    "require_exr",
    "write_image",
]

SUFFIXES = (".png", ".npy", ".exr")
"""Endings of picture files that can be written."""


def displayed(image: NDArray[np.floating], display: Display) -> NDArray[np.uint8]:
    """Codes of a linear image (H, W, 3), rounded to the nearest.

    NaN becomes 0, what is out of range is clipped.
    """
    with np.errstate(over="ignore"):
        exposed = image.astype(np.float64) * 2.0**display.exposure
    # fmax takes the other number where one is NaN; clip would keep it.
    clipped = np.fmin(np.fmax(exposed, 0.0), 1.0)
    encoded = srgb_from_linear(clipped) if display.transfer == "srgb" else clipped
    return np.floor(encoded * 255 + 0.5).astype(np.uint8)


def encode_png(image: NDArray[np.floating], display: Display) -> bytes:
    """A PNG file of a linear image (H, W, 3)."""
    return _png(Image.fromarray(displayed(image, display)))


def encode_thumbnail(image: NDArray[np.floating], display: Display, width: int) -> bytes:
    """A PNG file of a linear image (H, W, 3) with at most so many columns; a smaller image stays as it is.

    Its pixels are means of displayed codes.
    """
    small = Image.fromarray(displayed(image, display))
    small.thumbnail((width, image.shape[0]), Image.Resampling.BOX)
    return _png(small)


def _png(picture: Image.Image) -> bytes:
    buffer = io.BytesIO()
    picture.save(buffer, format="PNG", compress_level=4)
    return buffer.getvalue()


def encode_npy(image: NDArray[np.floating]) -> bytes:
    """A NumPy file of a linear image, float32."""
    return encode_layer(image.astype(np.float32))


def encode_layer(values: NDArray[Any]) -> bytes:
    """A NumPy file of a layer, in its own dtype."""
    buffer = io.BytesIO()
    np.save(buffer, values, allow_pickle=False)
    return buffer.getvalue()


def encode(
    suffix: str,
    image: NDArray[np.floating],
    display: Display,
    layers: Mapping[str, NDArray[Any]] | None = None,
) -> bytes:
    """A picture file by its ending, one of `SUFFIXES`; only .exr has room for layers.

    Raises
    ------
    MissingExtraError
        If the library for .exr is not installed.
    """
    if suffix == ".png":
        return encode_png(image, display)
    return encode_exr(image, layers) if suffix == ".exr" else encode_npy(image)


def write_image(
    path: str | os.PathLike[str],
    image: NDArray[np.floating],
    display: Display,
    layers: Mapping[str, NDArray[Any]] | None = None,
) -> None:
    """Write a linear image as .png, .npy or .exr; the file is written whole or not at all.

    Parameters
    ----------
    layers
        Written to .exr only.

    Raises
    ------
    MissingExtraError
        If the library for .exr is not installed.
    ImageFileError
        If the ending is not known, or the file cannot be written.
    """
    target = Path(path)
    if target.suffix not in SUFFIXES:
        raise ImageFileError(f"{target.name}: the name of a picture must end in {' or '.join(SUFFIXES)}.")
    content = encode(target.suffix, image, display, layers)
    try:
        _replace(target, content)
    except OSError as error:
        raise ImageFileError(f"{target}: cannot be written ({error.strerror}).") from error


def _replace(target: Path, content: bytes) -> None:
    handle, name = tempfile.mkstemp(dir=target.parent, prefix=f".{target.name}.")
    temporary = Path(name)
    try:
        with os.fdopen(handle, "wb") as file:
            file.write(content)
        temporary.chmod(0o644)
        temporary.replace(target)
    except BaseException:
        temporary.unlink(missing_ok=True)
        raise
