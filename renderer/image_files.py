"""Pictures as files."""

import io
import os
import tempfile
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from PIL import Image

from renderer.colors import srgb_from_linear
from renderer.errors import ImageFileError
from schemas.display import Display

SUFFIXES = (".png", ".npy")
"""Endings of picture files that can be written."""


def displayed(image: NDArray[np.floating], display: Display) -> NDArray[np.uint8]:
    """Codes of a linear image (H, W, 3), rounded to the nearest.

    NaN becomes 0, what is out of range is clipped.
    """
    with np.errstate(over="ignore"):
        exposed = image.astype(np.float64) * 2.0**display.exposure
    clipped = np.clip(np.nan_to_num(exposed, nan=0.0, posinf=1.0, neginf=0.0), 0.0, 1.0)
    encoded = srgb_from_linear(clipped) if display.transfer == "srgb" else clipped
    return np.floor(encoded * 255 + 0.5).astype(np.uint8)


def encode_png(image: NDArray[np.floating], display: Display) -> bytes:
    """A PNG file of a linear image (H, W, 3)."""
    buffer = io.BytesIO()
    Image.fromarray(displayed(image, display)).save(buffer, format="PNG", compress_level=4)
    return buffer.getvalue()


def encode_npy(image: NDArray[np.floating]) -> bytes:
    """A NumPy file of a linear image, float32."""
    buffer = io.BytesIO()
    np.save(buffer, image.astype(np.float32), allow_pickle=False)
    return buffer.getvalue()


def write_image(path: str | os.PathLike[str], image: NDArray[np.floating], display: Display) -> None:
    """Write a linear image as .png or .npy; the file is there whole or not at all.

    Raises
    ------
    ImageFileError
        If the ending is not known, or the file cannot be written.
    """
    target = Path(path)
    if target.suffix not in SUFFIXES:
        raise ImageFileError(f"{target.name}: the name of a picture must end in {' or '.join(SUFFIXES)}.")
    content = encode_png(image, display) if target.suffix == ".png" else encode_npy(image)
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
