"""Pixels deeper than 8 bits in PNG, TIFF and PGM files, which Pillow would truncate to 8 bits or misread."""

import sys
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray
from PIL import Image
from PIL.ImageFile import ImageFile

from renderer.assets import AssetError

_NATIVE = "L" if sys.byteorder == "little" else "B"
_OTHER_BYTE = {"L": "B", "B": "L", "N": "B" if _NATIVE == "L" else "L"}
"""Pillow keeps the high byte of each number in this order: in the other order it keeps the low one."""

_COLORS = ("RGB;16", "RGBA;16", "RGBX;16")
_GREY_ALPHA = "LA;16B"

BITS, PHOTOMETRIC, PLANES, SAMPLE_FORMAT = 258, 262, 284, 339
"""Tags of TIFF."""

WHITE_IS_ZERO, SEPARATE, SIGNED = 0, 2, 2
"""Values of the last three of these tags."""

GREY = ("I", "I;16", "I;16B", "I;16L")
"""Modes of one channel that Pillow reads fully."""

_MAX_CODE = (1 << 16) - 1

Codes = NDArray[np.integer]


@dataclass(frozen=True, slots=True, eq=False)
class DeepPixels:
    """Whole numbers of a picture.

    Attributes
    ----------
    codes : (H, W, channels)
        Of grey, grey and alpha, three colours, or three and alpha.
    largest : int
        That there may be.
    clear : sequence of int or None
        The one colour that is transparent by a PNG's `tRNS`.
    """

    codes: Codes
    largest: int
    clear: NDArray[Any] | None = None

    @property
    def colors(self) -> Codes:
        """Numbers without alpha, (H, W) of grey or (H, W, 3)."""
        return self.codes[..., :3] if self.codes.shape[2] > 2 else self.codes[..., 0]

    @property
    def has_alpha(self) -> bool:
        """Whether some pixel is not opaque."""
        if self.clear is not None:
            return bool((self.codes == self.clear).all(axis=2).any())
        return self.codes.shape[2] in {2, 4} and bool((self.codes[..., -1] < self.largest).any())


def is_deep(image: Image.Image) -> bool:
    """Whether an opened picture has whole numbers of more than 8 bits."""
    return image.mode in GREY or _is_halved(image)


def read(image: Image.Image, reopened: Callable[[], Image.Image]) -> DeepPixels:
    """The numbers of a deep picture.

    Parameters
    ----------
    image
        As opened: nothing of it is decoded yet.
    reopened
        Gives the same once more.
    """
    clear = image.info.get("transparency")
    key = None if clear is None else np.atleast_1d(clear)
    if not _is_halved(image):
        return DeepPixels(*_grey(image), key)
    if _GREY_ALPHA in _raw_modes(image):
        # Its four bytes are read as those of four channels.
        found = _decoded(image, lambda _: "RGBA").astype(np.uint16)
        return DeepPixels(found[..., 0::2] << 8 | found[..., 1::2], _MAX_CODE)
    found = _decoded(image, lambda mode: mode).astype(np.uint16)
    found <<= 8
    found |= _decoded(reopened(), lambda mode: mode[:-1] + _OTHER_BYTE[mode[-1]])
    return DeepPixels(found, _MAX_CODE, key)


def _grey(image: Image.Image) -> tuple[Codes, int]:
    """Numbers (H, W, 1), and the largest: Pillow takes 32 bits as signed, and leaves 12 bits as they are."""
    codes = np.asarray(image)[..., None]
    bits = _bits(image)
    if image.mode == "I" and bits == 32:
        return codes.view(np.uint32), (1 << 32) - 1
    return codes, (1 << bits) - 1 if 8 < bits < 16 else _MAX_CODE


def floats(image: Image.Image) -> NDArray[np.float32]:
    """Numbers (H, W) of an opened picture of floating-point grey.

    Decompressed TIFF has them in this machine's byte order, whatever that of the file is.
    """
    if any(tile.codec_name == "libtiff" for tile in getattr(image, "tile", ())):
        return _decoded(image, lambda _: "F;32NF")
    return np.asarray(image)


def _bits(image: Image.Image) -> int:
    """Bits of a channel by a TIFF's own words; 0 for other pictures."""
    tags = getattr(image, "tag_v2", None)
    return 0 if tags is None else max(tags.get(BITS, (1,)))


def _raw_modes(image: Image.Image) -> set[str]:
    """Raw mode of an opened picture, as Pillow names it."""
    args = [tile.args for tile in getattr(image, "tile", ())]
    return {arg if isinstance(arg, str) else str(arg[0]) for arg in args if arg}


def _is_halved(image: Image.Image) -> bool:
    """Whether Pillow would drop half the bits of an opened picture."""
    return any(mode == _GREY_ALPHA or mode[:-1] in _COLORS for mode in _raw_modes(image))


def _decoded(image: Image.Image, raw: Callable[[str], str]) -> NDArray[Any]:
    assert isinstance(image, ImageFile)
    with image:
        image.tile = [_as(tile, raw) for tile in image.tile]
        return np.asarray(image)


def _as(tile: Any, raw: Callable[[str], str]) -> Any:
    """The same part of a file, its bytes read in another way."""
    args = tile.args
    return tile._replace(args=raw(args) if isinstance(args, str) else (raw(args[0]), *args[1:]))


def refuse_unreadable(image: Image.Image) -> None:
    """Raise AssetError if an opened TIFF picture would be read wrongly."""
    tags = getattr(image, "tag_v2", None)
    if tags is None:
        return
    bits, kind = _bits(image), None
    if SIGNED in tags.get(SAMPLE_FORMAT, (1,)):
        kind = "whole numbers with a sign"
    elif bits > 8 and tags.get(PHOTOMETRIC) == WHITE_IS_ZERO:
        kind = f"{bits} bits in which 0 is white"
    elif bits > 8 and image.mode != "F" and (not is_deep(image) or tags.get(PLANES) == SEPARATE):
        kind = f"{image.mode} with {bits} bits a channel in a form of which half would be lost"
    if kind is not None:
        raise AssetError(f"This TIFF picture stores {kind}. Save it as PNG with 8 or 16 bits, or as EXR.")
