"""Reader of the pictures that a scene names, without rounding."""

import io
import struct
import warnings
from collections.abc import Callable
from dataclasses import replace
from typing import Protocol

import numpy as np
from numpy.typing import NDArray
from PIL import ExifTags, Image

from renderer.assets import PILLOW_PIXELS, AssetError, changed_filters, too_many_pixels
from renderer.errors import ImageFileError, MissingExtraError
from renderer.images import deep_pixels, exr_reading, portable, radiance
from renderer.images.decoded import ALPHA, DAMAGED, DecodedImage, of_codes, of_light
from schemas.limits import limits_in_force
from schemas.reading.file_kinds import recognise

FORMATS_OF_PILLOW = ("PNG", "JPEG", "WEBP", "TIFF", "BMP", "GIF", "PPM")

FORMATS = (*FORMATS_OF_PILLOW, "PFM", "HDR", "EXR")
"""Picture formats that are read."""

DAMAGE_ERRORS = (OSError, SyntaxError, ValueError, EOFError, LookupError, TypeError, struct.error)
"""Exceptions of Pillow for invalid content, depending on the format."""

Values = NDArray[np.float32]

READABLE = ("1", "L", "P", "PA", "LA", "La", "RGB", "RGBA", "RGBa", "RGBX", "CMYK", "YCbCr")
"""Modes that Pillow turns into red, green and blue of 8 bits."""


class Reader(Protocol):
    """A module that reads a format."""

    MEDIA_TYPE: str

    def recognises(self, content: bytes) -> bool:
        """Whether the content begins as such a picture."""
        ...

    def size_of(self, content: bytes) -> tuple[int, int]:
        """Width and height from its header."""
        ...

    def decode(self, content: bytes) -> DecodedImage:
        """The picture."""
        ...


def image_size(content: bytes, max_pixels: int | None = None) -> tuple[int, int]:
    """Width and height from a picture's header, without decoding it.

    Raises
    ------
    AssetError
        If it is not a picture of a known format, or has more than `max_pixels` pixels, by default those of
        the limits in force.
    """
    most = _allowed(max_pixels)
    reader = _reader(content)
    if reader is None:
        with _opened(content, most) as image:
            return upright_size(image)
    width, height = reader.size_of(content)
    if width * height > most:
        raise AssetError(too_many_pixels(most, f"{width} x {height} pixels, "))
    return width, height


def upright_size(image: Image.Image) -> tuple[int, int]:
    """Width and height of a picture that Pillow has opened, turned as its EXIF orientation says."""
    width, height = image.size
    return (height, width) if _orientation(image) in SWAPPING_ORIENTATIONS else (width, height)


def media_type_beside_pillow(content: bytes) -> str | None:
    """The media type of a picture that is not read by Pillow; None for all other content."""
    reader = _reader(content)
    return None if reader is None else reader.MEDIA_TYPE


def decode_image(content: bytes, max_pixels: int | None = None) -> NDArray[np.float32]:
    """The values of `read_image`; raises as it does."""
    return read_image(content, max_pixels).values


def read_image(content: bytes, max_pixels: int | None = None) -> DecodedImage:
    """Decode a picture.

    Raises
    ------
    AssetError
        If it is not a picture of a known format, is damaged, stores numbers that are not read, or has more
        than `max_pixels` pixels, by default those of the limits in force.
    """
    reader = _reader(content)
    if reader is not None:
        image_size(content, max_pixels)
        return reader.decode(content)
    image = _opened(content, _allowed(max_pixels))
    try:
        with changed_filters():
            warnings.simplefilter("ignore")
            return _decoded(image, content)
    except AssetError:
        raise
    except DAMAGE_ERRORS as error:
        raise AssetError(DAMAGED) from error
    finally:
        image.close()


class _Exr:
    """Reads EXR files as pictures of a scene."""

    MEDIA_TYPE = "image/x-exr"

    def recognises(self, content: bytes) -> bool:
        return content.startswith(exr_reading.SIGNATURE)

    def size_of(self, content: bytes) -> tuple[int, int]:
        try:
            return exr_reading.size_of_exr(content)
        except (ImageFileError, MissingExtraError) as error:
            raise AssetError(str(error)) from error

    def decode(self, content: bytes) -> DecodedImage:
        try:
            # Its size was checked, against the caller's limit.
            found = exr_reading.read_exr(content, PILLOW_PIXELS, ())
        except (ImageFileError, MissingExtraError) as error:
            raise AssetError(str(error)) from error
        clear = found.alpha is not None and bool((found.alpha != 1).any())
        return of_light(found.image, (*found.notes, *((ALPHA,) if clear else ())))


_READERS: tuple[Reader, ...] = (portable, radiance, _Exr())
"""Readers of formats that Pillow does not read."""


def _reader(content: bytes) -> Reader | None:
    return next((reader for reader in _READERS if reader.recognises(content)), None)


def _allowed(max_pixels: int | None) -> int:
    return limits_in_force().max_image_pixels if max_pixels is None else max_pixels


def _decoded(image: Image.Image, content: bytes) -> DecodedImage:
    """A picture that Pillow reads, turned as its EXIF orientation says."""
    orientation = _orientation(image)
    deep_pixels.refuse_unreadable(image)
    if image.mode == "F":
        found = of_light(deep_pixels.floats(image))
    elif deep_pixels.is_deep(image):
        stored = deep_pixels.read(image, lambda: _open(content))
        found = of_codes(stored.colors, stored.largest, (ALPHA,) if stored.has_alpha else ())
    elif image.mode in READABLE:
        found = _in_bands(image)
    else:
        raise AssetError(f"This picture stores {image.mode} colours. Save it as red, green and blue.")
    return replace(found, values=_turned(found.values, orientation))


BAND_PIXELS = 1 << 20
"""Pixels that are converted at once: beside the picture as floats only these take memory."""


def _in_bands(image: Image.Image) -> DecodedImage:
    """A picture of 8 bits, converted band by band."""
    clear = False
    if image.has_transparency_data:
        image = image.convert("RGBA")
        clear = image.getchannel("A").getextrema()[0] != 255
    elif image.mode != "RGB":
        image = image.convert("RGB")
    values = np.empty((image.height, image.width, 3), dtype=np.float32)
    rows = max(1, BAND_PIXELS // max(1, image.width))
    for top in range(0, image.height, rows):
        band = image.crop((0, top, image.width, min(top + rows, image.height)))
        codes = np.asarray(band)[..., :3]
        np.divide(codes, np.float32(255), out=values[top : top + rows], dtype=np.float32)
    return DecodedImage(values, notes=(ALPHA,) if clear else ())


SWAPPING_ORIENTATIONS = (5, 6, 7, 8)
"""EXIF orientations that swap width and height."""

_ORIENTATIONS: dict[int, Callable[[Values], Values]] = {
    2: lambda values: values[:, ::-1],
    3: lambda values: values[::-1, ::-1],
    4: lambda values: values[::-1],
    5: lambda values: values.swapaxes(0, 1),
    6: lambda values: values[::-1].swapaxes(0, 1),
    7: lambda values: values[::-1, ::-1].swapaxes(0, 1),
    8: lambda values: values[:, ::-1].swapaxes(0, 1),
}
"""Upright pictures of stored ones (CIPA DC-008, Orientation)."""


def _orientation(image: Image.Image) -> int:
    """EXIF orientation; 1, upright, where there is none. Pillow itself turns TIFF."""
    exif = Image.Exif()
    try:
        with changed_filters():
            warnings.simplefilter("ignore")
            exif.load(image.info.get("exif", b""))
            orientation = exif.get(ExifTags.Base.Orientation, 1)
    except DAMAGE_ERRORS:
        return 1
    return orientation if orientation in _ORIENTATIONS else 1


def _turned(values: Values, orientation: int) -> Values:
    turn = _ORIENTATIONS.get(orientation)
    return values if turn is None else np.ascontiguousarray(turn(values))


def _opened(content: bytes, most: int) -> Image.Image:
    try:
        with changed_filters():
            warnings.simplefilter("ignore")
            image = _open(content)
    except Image.DecompressionBombError as error:
        raise AssetError(too_many_pixels(most)) from error
    except DAMAGE_ERRORS as error:
        raise AssetError(_no_picture(content)) from error
    width, height = image.size
    if width * height > most:
        image.close()
        raise AssetError(too_many_pixels(most, f"{width} x {height} pixels, "))
    return image


def _open(content: bytes) -> Image.Image:
    return Image.open(io.BytesIO(content), formats=FORMATS_OF_PILLOW)


def _no_picture(content: bytes) -> str:
    kind = recognise(content)
    if kind is not None and kind.name == "tiff":
        return (
            "This TIFF picture cannot be read: it is damaged, or stores its pixels in a rare form, such as "
            f"floating-point colours. Use one of {', '.join(FORMATS)}."
        )
    # A file that begins like a PNG but is none is not a picture of any other kind either.
    another = kind is not None and kind.name.upper() not in FORMATS
    given = f"This is {kind.phrase}" if kind and another else "This is not a picture that can be read"
    return f"{given}. Use one of {', '.join(FORMATS)}."
