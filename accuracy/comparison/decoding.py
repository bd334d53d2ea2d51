"""Numbers from the bytes of PNG, NPY and EXR files, without a guess about what they mean."""

import io
import warnings
from collections.abc import Mapping
from dataclasses import dataclass, field
from tokenize import TokenError
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray
from PIL import Image

from renderer.assets import changed_filters
from renderer.errors import ImageFileError, MissingExtraError
from renderer.images.exr import decode_exr
from renderer.math.arrays import Floats
from schemas.limits import how_to_raise, limits_in_force

PNG, NPY, EXR = b"\x89PNG\r\n\x1a\n", b"\x93NUMPY", b"\x76\x2f\x31\x01"

BIT_DEPTH, COLOR_TYPE = slice(24, 25), slice(25, 26)
"""Places of these bytes in a PNG file (ISO 15948, 11.2.1)."""

TRUE_COLOR = (b"\x02", b"\x06")
"""Colour types of PNG with three colours, without and with alpha."""


@dataclass(frozen=True, slots=True, eq=False)
class Raw:
    """The numbers of a file.

    Attributes
    ----------
    values : (H, W, 3) float64
        As stored; whole numbers divided by the largest.
    bits : int
        Of a channel, 32 or 64 for floating point.
    usual : {"srgb", "linear"} or None
        What numbers in a file of this kind usually mean; None where there is no custom.
    """

    values: Floats
    bits: int
    usual: Literal["srgb", "linear"] | None
    notes: tuple[str, ...] = ()
    layers: Mapping[str, NDArray[Any]] = field(default_factory=dict)


def decode(content: bytes, name: str) -> Raw:
    """The numbers of a PNG, NPY or EXR file.

    Raises
    ------
    NotComparableError
        If it is none of these, is damaged or too large, or is not a picture without transparency.
    """
    if content.startswith(PNG):
        return _png(content, name)
    if content.startswith(NPY):
        return _npy(content, name)
    if content.startswith(EXR):
        return _exr(content, name)
    raise NotComparableError(f"{name} is not a PNG, NPY or EXR file. Save the picture as one of these.")


def _png(content: bytes, name: str) -> Raw:
    if content[BIT_DEPTH] == b"\x10" and content[COLOR_TYPE] in TRUE_COLOR:
        # Pillow would drop eight of the sixteen bits without a word.
        raise NotComparableError(
            f"{name} is a PNG with 16 bits a channel. Save it with 8 bits, or as NPY or EXR."
        )
    try:
        with changed_filters():
            # Its size is checked here, against another limit.
            warnings.simplefilter("ignore", Image.DecompressionBombWarning)
            picture: Image.Image = Image.open(io.BytesIO(content), formats=["PNG"])
            _bounded(picture.size[::-1], name)
            picture.load()
    except (OSError, SyntaxError, ValueError, Image.DecompressionBombError) as error:
        raise NotComparableError(f"{name} is a damaged PNG file.") from error
    if picture.mode.startswith("I"):
        raise NotComparableError(f"{name} is a PNG with 16 bits of grey. Save it with 8 bits per channel.")
    if picture.mode == "P" or "transparency" in picture.info:
        picture = picture.convert("RGBA")
    elif picture.mode == "1":
        picture = picture.convert("L")
    return _whole(np.asarray(picture), name, "srgb")


_DAMAGE = (ValueError, EOFError, OSError, TypeError, KeyError, SyntaxError, RecursionError, TokenError)
"""What NumPy raises for files that make no sense."""


def _npy(content: bytes, name: str) -> Raw:
    try:
        array = np.load(io.BytesIO(content), allow_pickle=False)
    # A few bytes may claim any size, and the header is read as Python is.
    except (*_DAMAGE, MemoryError) as error:
        raise NotComparableError(f"{name} is a damaged NPY file, or holds objects.") from error
    if array.dtype in (np.uint8, np.uint16):
        return _whole(array, name, None)
    if array.dtype.kind != "f":
        raise NotComparableError(
            f"{name} holds {array.dtype}. A picture holds float32, or uint8 with an encoding."
        )
    colors, notes = _three(array, 1.0, name)
    return Raw(colors.astype(np.float64), max(32, 8 * array.dtype.itemsize), "linear", notes)


def _exr(content: bytes, name: str) -> Raw:
    try:
        image, layers = decode_exr(content)
    except MissingExtraError:
        raise
    except ImageFileError as error:
        raise NotComparableError(f"{name}: {error}") from error
    _bounded(image.shape, name)
    return Raw(image.astype(np.float64), 32, "linear", layers=layers)


def _whole(array: NDArray[Any], name: str, usual: Literal["srgb"] | None) -> Raw:
    largest = np.iinfo(array.dtype).max
    colors, notes = _three(array, largest, name)
    return Raw(colors / largest, 8 * array.dtype.itemsize, usual, notes)


def _three(array: NDArray[Any], opaque: float, name: str) -> tuple[NDArray[Any], tuple[str, ...]]:
    """Three colours of a grey picture, or of one with alpha that hides nothing."""
    _bounded(array.shape, name)
    if array.ndim == 2:
        array = array[:, :, None]
    if array.ndim != 3 or array.shape[2] not in (1, 2, 3, 4):
        raise NotComparableError(f"{name} has the shape {array.shape}. A picture has (height, width, 3).")
    notes: tuple[str, ...] = ()
    if array.shape[2] in (2, 4):
        if not (array[:, :, -1] == opaque).all():
            raise NotComparableError(
                f"{name} is transparent in places, and what is behind it is unknown. Save it without alpha."
            )
        array, notes = array[:, :, :-1], ("Its alpha is 1 everywhere and was left out.",)
    if array.shape[2] == 1:
        array, notes = (
            array.repeat(3, axis=2),
            (*notes, "It is grey: red, green and blue were taken as equal."),
        )
    return array, notes


def _bounded(shape: tuple[int, ...], name: str) -> None:
    most = limits_in_force().max_image_pixels
    if len(shape) > 1 and shape[0] * shape[1] > most:
        cure = f"Compare parts of it. {how_to_raise('max_image_pixels')}"
        raise NotComparableError(f"{name} has more than {most} pixels. {cure}")
    if 0 in shape:
        raise NotComparableError(f"{name} has no pixels.")


class NotComparableError(ImageFileError):
    """Nothing can be said about these pictures; the message says why and what to do."""
