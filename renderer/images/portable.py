"""Portable pixmaps that Pillow rounds or cannot read: PPM deeper than 8 bits, and floating-point PFM."""

import re
from typing import Any

import numpy as np
from numpy.typing import NDArray

from renderer.assets import AssetError
from renderer.images.decoded import DAMAGED, DecodedImage, of_codes, of_light

MEDIA_TYPE = "image/x-portable-anymap"

_BLANK = rb"(?:\s|#[^\r\n]*[\r\n])+"
_HEADER = re.compile(
    rb"P(?:[36]|F|f)" + _BLANK + _BLANK.join([rb"(\d{1,9})"] * 2) + _BLANK + rb"([-+.\deE]{1,30})\s"
)


def recognises(content: bytes) -> bool:
    """Whether the content is PFM, or a PPM of colours with more than 8 bits."""
    if content.startswith((b"PF", b"Pf")):
        return content[2:3].isspace()
    head = _HEADER.match(content) if content.startswith((b"P3", b"P6")) else None
    return head is not None and head[3].isdigit() and 255 < int(head[3]) < 1 << 16


def size_of(content: bytes) -> tuple[int, int]:
    """Width and height, pixels; AssetError for a damaged header."""
    head = _header(content)
    return int(head[1]), int(head[2])


def decode(content: bytes) -> DecodedImage:
    """Decode such a picture; AssetError if it is damaged."""
    head = _header(content)
    body, size = content[head.end() :], (int(head[2]), int(head[1]))
    return (
        _floating(content, body, size, head[3])
        if content[1:2] in b"Ff"
        else _whole(content, body, size, int(head[3]))
    )


def _header(content: bytes) -> re.Match[bytes]:
    head = _HEADER.match(content)
    if head is None or 0 in (int(head[1]), int(head[2])):
        raise AssetError(DAMAGED)
    return head


def _floating(content: bytes, body: bytes, size: tuple[int, int], scale: bytes) -> DecodedImage:
    """PFM has its rows from bottom to top; a scale below 0 says that the numbers are little-endian."""
    try:
        factor = float(scale)
    except ValueError:
        raise AssetError(DAMAGED) from None
    if abs(factor) != 1:
        raise AssetError(
            f"This PFM picture has the scale {factor:g}, whose meaning programs disagree about. Save it with "
            "the scale 1 or -1."
        )
    shape = (*size, 3) if content[1:2] == b"F" else size
    values = _numbers(body, "<f4" if factor < 0 else ">f4", shape)
    return of_light(values[::-1])


def _whole(content: bytes, body: bytes, size: tuple[int, int], largest: int) -> DecodedImage:
    shape = (*size, 3)
    if content[1:2] == b"6":
        return of_codes(np.minimum(_numbers(body, ">u2", shape), largest), largest)
    count = shape[0] * shape[1] * 3
    words = re.sub(rb"#[^\r\n]*", b"", body).split(None, count)[:count]
    if len(words) < count or not all(word.isdigit() and int(word) <= largest for word in words):
        raise AssetError(DAMAGED)
    return of_codes(np.array([int(word) for word in words], np.uint16).reshape(shape), largest)


def _numbers(body: bytes, kind: str, shape: tuple[int, ...]) -> NDArray[Any]:
    count = int(np.prod(shape))
    if len(body) < count * np.dtype(kind).itemsize:
        raise AssetError(DAMAGED)
    return np.frombuffer(body, kind, count).reshape(shape)


def encode_pfm(values: NDArray[np.floating]) -> bytes:
    """A PFM file of floating-point numbers (H, W, 3), float32."""
    height, width = values.shape[:2]
    return b"PF\n%d %d\n-1.0\n" % (width, height) + values[::-1].astype("<f4").tobytes()
