"""Pictures as files."""

import io
import os
import tempfile
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import IO, Any

import numpy as np
from numpy.typing import DTypeLike, NDArray
from PIL import Image

from renderer.errors import ImageFileError
from renderer.images.colors import srgb_from_linear
from renderer.images.exr import encode_exr, require_exr, write_exr
from renderer.images.exr_reading import decode_exr
from renderer.images.png import write_codes
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
    "layer_path",
    "require_exr",
    "write_exr",
    "write_image",
    "write_layer",
    "write_npy",
    "write_png",
]

SUFFIXES = (".png", ".npy", ".exr")
"""Endings of picture files that can be written."""


BAND_PIXELS = 1 << 15
"""Pixels whose codes are computed at once: intermediate results take about 150 bytes for each."""


def displayed(image: NDArray[np.floating], display: Display) -> NDArray[np.uint8]:
    """Codes of 8 bits of a linear image (H, W, 3), rounded to the nearest.

    NaN becomes 0, what is out of range is clipped.
    """
    return _rounded(image, display, np.dtype(np.uint8))


def _rounded(image: NDArray[np.floating], display: Display, kind: np.dtype[Any]) -> NDArray[Any]:
    codes = np.empty(image.shape, kind)
    rows = max(1, BAND_PIXELS // max(1, image.shape[1]))
    for top in range(0, image.shape[0], rows):
        codes[top : top + rows] = _codes(image[top : top + rows], display, np.iinfo(kind).max)
    return codes


def _codes(image: NDArray[np.floating], display: Display, largest: int) -> NDArray[np.floating]:
    with np.errstate(over="ignore"):
        exposed = image.astype(np.float64) * 2.0**display.exposure
    # fmax takes the other number where one is NaN; clip would keep it.
    clipped = np.fmin(np.fmax(exposed, 0.0), 1.0)
    encoded = srgb_from_linear(clipped) if display.transfer == "srgb" else clipped
    return np.floor(encoded * largest + 0.5)


def encode_png(image: NDArray[np.floating], display: Display, bits: int = 8) -> bytes:
    """A PNG file of a linear image (H, W, 3), with 8 or 16 bits a channel."""
    buffer = io.BytesIO()
    if bits == 16:
        write_codes(buffer, image.shape[:2], [_rounded(image, display, np.dtype(np.uint16))], bits)
    else:
        write_png(buffer, image.shape[:2], [image], display)
    return buffer.getvalue()


def write_png(
    file: IO[bytes],
    size: Sequence[int],
    bands: Iterable[NDArray[np.floating]],
    display: Display,
    width: int | None = None,
) -> None:
    """Write a PNG file of a linear image that comes in bands of rows, from top to bottom.

    Besides a band there are 4 bytes of each pixel in memory.

    Parameters
    ----------
    size
        Height and width, pixels.
    bands : iterable of (h, W, 3)
    width
        Most columns of a thumbnail, whose pixels are means of displayed codes; a smaller image stays as it
        is.
    """
    height, columns = size
    picture = Image.new("RGB", (columns, height))
    top = 0
    for band in bands:
        picture.paste(Image.fromarray(displayed(band, display)), (0, top))
        top += len(band)
    if width is not None:
        picture.thumbnail((width, height), Image.Resampling.BOX)
    picture.save(file, format="PNG", compress_level=4)


def write_npy(file: IO[bytes], shape: Sequence[int], dtype: DTypeLike, bands: Iterable[NDArray[Any]]) -> None:
    """Write a NumPy file of an array that comes in bands of rows, from top to bottom."""
    descr = np.lib.format.dtype_to_descr(np.dtype(dtype))
    head = {"descr": descr, "fortran_order": False, "shape": tuple(shape)}
    np.lib.format.write_array_header_1_0(file, head)
    for band in bands:
        file.write(np.ascontiguousarray(band, dtype).data)


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
    *,
    bits: int = 8,
) -> bytes:
    """A picture file by its ending, one of `SUFFIXES`; only .exr has room for layers.

    Parameters
    ----------
    bits : {8, 16}
        Of a channel of .png; the others are float32.

    Raises
    ------
    MissingExtraError
        If the library for .exr is not installed.
    """
    if suffix == ".png":
        return encode_png(image, display, bits)
    return encode_exr(image, layers) if suffix == ".exr" else encode_npy(image)


def write_image(
    path: str | os.PathLike[str],
    image: NDArray[np.floating],
    display: Display,
    layers: Mapping[str, NDArray[Any]] | None = None,
    *,
    bits: int = 8,
) -> None:
    """Write a linear image as .png, .npy or .exr; the file is written whole or not at all.

    Parameters
    ----------
    layers
        Written to .exr only.
    bits : {8, 16}
        Of a channel of .png.

    Raises
    ------
    MissingExtraError
        If the library for .exr is not installed.
    ImageFileError
        If the ending is unknown or has no such depth, or the file cannot be written.
    """
    target = Path(path)
    suffix = target.suffix.lower()
    if suffix not in SUFFIXES:
        raise ImageFileError(f"{target.name}: the name of a picture must end in {' or '.join(SUFFIXES)}.")
    if bits != 8 and (bits != 16 or suffix != ".png"):
        raise ImageFileError(f"{target.name}: 'bits' is 8 or 16, and 16 is for .png, not {bits}.")
    _write(target, encode(suffix, image, display, layers, bits=bits))


def layer_path(picture: Path, name: str) -> Path:
    """Path of a layer: beside its picture, named after it."""
    return picture.with_name(f"{picture.name}.{name}.npy")


def write_layer(path: Path, values: NDArray[Any]) -> None:
    """Write a layer as .npy, whole or not at all; ImageFileError if it cannot be written."""
    _write(path, encode_layer(values))


def _write(target: Path, content: bytes) -> None:
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
