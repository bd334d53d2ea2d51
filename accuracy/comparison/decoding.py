"""Decoder of PNG, NPY and EXR files, without an assumption about their encoding."""

import io
import math
import warnings
from collections.abc import Collection, Mapping
from dataclasses import dataclass, field
from tokenize import TokenError
from typing import Any, Literal

import numpy as np
from numpy.lib import format as npy
from numpy.typing import NDArray
from PIL import Image

from renderer.assets import changed_filters
from renderer.errors import ImageFileError
from renderer.images import deep_pixels
from renderer.images.deep_pixels import DeepPixels
from renderer.images.exr_reading import read_exr, size_of_exr
from schemas.limits import how_to_raise, limits_in_force

PNG, NPY, EXR = b"\x89PNG\r\n\x1a\n", b"\x93NUMPY", b"\x76\x2f\x31\x01"

Content = bytes | bytearray
"""Bytes of a file."""

Size = tuple[int, int]
"""Width and height in pixels."""

HEADER_BYTES = 1 << 14
"""Bytes read for the header of an NPY file: NumPy's own limit is 10,000."""

OPAQUE_NOTE = "Its alpha is 1 everywhere and was left out."
GREY_NOTE = "It is grey: red, green and blue were taken as equal."


@dataclass(frozen=True, slots=True, eq=False)
class Raw:
    """The numbers of a file.

    Attributes
    ----------
    values : (H, W, 3)
        As stored: codes of 8 or 16 bits, or floating-point numbers.
    bits : int
        Of a channel, 32 or 64 for floating point.
    usual : {"srgb", "linear"} or None
        The usual encoding of such files; None if there is none.
    """

    values: NDArray[Any]
    bits: int
    usual: Literal["srgb", "linear"] | None
    notes: tuple[str, ...] = ()
    layers: Mapping[str, NDArray[Any]] = field(default_factory=dict)


def decode(content: Content, name: str, layers: Collection[str], size: Size | None = None) -> Raw:
    """The numbers of a PNG, NPY or EXR file, and the named ones of its layers.

    Raises
    ------
    NotComparableError
        If it is none of these, damaged, too large, or transparent. Another size than `size` is refused
        before decoding.
    """
    if size is not None:
        refuse_other_size(name, size_of(content), size)
    if content.startswith(PNG):
        return _png(content, name)
    if content.startswith(NPY):
        return _npy(content, name)
    if content.startswith(EXR):
        return _exr(content, name, layers)
    raise NotComparableError(f"{name} is not a PNG, NPY or EXR file. Save the picture as one of these.")


def refuse_other_size(name: str, size: Size | None, wanted: Size) -> None:
    """Refuse a picture of another size than its reference.

    Raises
    ------
    NotComparableError
        If the size is known and differs.
    """
    if size in {None, wanted}:
        return
    (width, height), swapped = size, size == wanted[::-1]
    raise NotComparableError(
        f"{name} is {width} x {height} pixels, not {wanted[0]} x {wanted[1]} as its reference. "
        + ("Width and height are swapped." if swapped else "Render it at that size.")
    )


def size_of(content: Content) -> Size | None:
    """Width and height by the header of a file; None if it is damaged, which decoding explains."""
    try:
        if content.startswith(PNG):
            return _opened(content).size
        if content.startswith(EXR):
            return size_of_exr(bytes(content))
        if content.startswith(NPY):
            shape = _header_of_npy(content)[0]
            return (shape[1], shape[0]) if len(shape) > 1 else None
    except (*DAMAGE_ERRORS, ImageFileError):
        return None
    return None


def _header_of_npy(content: Content) -> tuple[tuple[int, ...], bool, np.dtype[Any], int]:
    """Shape, whether columns come first, type, and bytes of the header."""
    file = io.BytesIO(content[:HEADER_BYTES])
    version = npy.read_magic(file)
    if version not in {(1, 0), (2, 0)}:
        raise ValueError(version)
    read = npy.read_array_header_1_0 if version == (1, 0) else npy.read_array_header_2_0
    return (*read(file), file.tell())


def array_of(content: Content) -> NDArray[Any]:
    """The array of an NPY file, without a copy of its numbers.

    Raises
    ------
    ValueError
        Or another of `DAMAGE_ERRORS`, if the file is damaged or holds objects.
    """
    shape, by_columns, kind, start = _header_of_npy(content)
    if kind.hasobject:
        raise ValueError(kind)
    count = math.prod(shape)
    numbers = np.frombuffer(content, kind, count, start) if count else np.empty(0, kind)
    return numbers.reshape(shape, order="F" if by_columns else "C")


def _png(content: Content, name: str) -> Raw:
    try:
        with changed_filters():
            # Its size is checked here, against another limit.
            warnings.simplefilter("ignore", Image.DecompressionBombWarning)
            picture = _opened(content)
            _bounded(picture.size[::-1], name)
            if deep_pixels.is_deep(picture):
                return _deep(deep_pixels.read(picture, lambda: _opened(content)), name)
            picture.load()
    except NotComparableError:
        raise
    except (OSError, SyntaxError, ValueError, Image.DecompressionBombError) as error:
        raise NotComparableError(f"{name} is a damaged PNG file.") from error
    if picture.mode == "P" or "transparency" in picture.info:
        picture = picture.convert("RGBA")
    elif picture.mode == "1":
        picture = picture.convert("L")
    return _whole(np.asarray(picture), name, "srgb")


def _opened(content: Content) -> Image.Image:
    return Image.open(io.BytesIO(content), formats=["PNG"])


def _deep(pixels: DeepPixels, name: str) -> Raw:
    if pixels.clear is not None and pixels.has_alpha:
        raise NotComparableError(_transparent(name))
    return _whole(pixels.codes, name, "srgb")


DAMAGE_ERRORS = (ValueError, EOFError, OSError, TypeError, KeyError, SyntaxError, RecursionError, TokenError)
"""Exceptions of NumPy for invalid files."""


def _npy(content: Content, name: str) -> Raw:
    try:
        array = array_of(content)
    # NumPy parses the header as a Python literal.
    except (*DAMAGE_ERRORS, MemoryError) as error:
        raise NotComparableError(f"{name} is a damaged NPY file, or holds objects.") from error
    if array.dtype in (np.uint8, np.uint16):
        return _whole(array, name, None)
    if array.dtype.kind != "f":
        raise NotComparableError(
            f"{name} holds {array.dtype}. A picture holds float32, or uint8 with an encoding."
        )
    colors, notes = _three(array, 1.0, name)
    return Raw(colors, max(32, 8 * array.dtype.itemsize), "linear", notes)


def _exr(content: Content, name: str, layers: Collection[str]) -> Raw:
    try:
        found = read_exr(bytes(content), layers=layers)
    except ImageFileError as error:
        raise NotComparableError(f"{name}: {error}") from error
    _bounded(found.image.shape, name)
    notes = found.notes
    if found.alpha is not None:
        if not (found.alpha == 1.0).all():
            raise NotComparableError(_transparent(name))
        notes = (*notes, OPAQUE_NOTE)
    if found.grey:
        notes = (*notes, GREY_NOTE)
    return Raw(found.image, 32, "linear", notes, found.layers)


def _whole(array: NDArray[Any], name: str, usual: Literal["srgb"] | None) -> Raw:
    largest = np.iinfo(array.dtype).max
    colors, notes = _three(array, largest, name)
    return Raw(colors, 8 * array.dtype.itemsize, usual, notes)


def _three(array: NDArray[Any], opaque: float, name: str) -> tuple[NDArray[Any], tuple[str, ...]]:
    """RGB of a grey picture, or of one with opaque alpha."""
    _bounded(array.shape, name)
    if array.ndim == 2:
        array = array[:, :, None]
    if array.ndim != 3 or array.shape[2] not in (1, 2, 3, 4):
        raise NotComparableError(f"{name} has the shape {array.shape}. A picture has (height, width, 3).")
    notes: tuple[str, ...] = ()
    if array.shape[2] in (2, 4):
        if not (array[:, :, -1] == opaque).all():
            raise NotComparableError(_transparent(name))
        array, notes = array[:, :, :-1], (OPAQUE_NOTE,)
    if array.shape[2] == 1:
        array, notes = np.broadcast_to(array, (*array.shape[:2], 3)), (*notes, GREY_NOTE)
    return array, notes


def _transparent(name: str) -> str:
    return f"{name} is transparent in places, and what is behind it is unknown. Save it without alpha."


def _bounded(shape: tuple[int, ...], name: str) -> None:
    most = limits_in_force().max_image_pixels
    if len(shape) > 1 and shape[0] * shape[1] > most:
        cure = f"Compare parts of it. {how_to_raise('max_image_pixels')}"
        raise NotComparableError(f"{name} has more than {most} pixels. {cure}")
    if 0 in shape:
        raise NotComparableError(f"{name} has no pixels.")


class NotComparableError(ImageFileError):
    """Nothing can be said about these pictures; the message says why and what to do."""
