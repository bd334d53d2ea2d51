"""Radiance pictures (.hdr): three mantissas of 8 bits with one exponent, run-length encoded.

The format is that of Ward, "Real Pixels", Graphics Gems II (1991), and of the file formats of Radiance. Its
header may name an exposure that the numbers were multiplied by: they are read as stored.
"""

import re

import numpy as np
from numpy.typing import NDArray

from renderer.assets import AssetError
from renderer.images.decoded import DAMAGED, DecodedImage, of_light

_LONGEST_HEADER = 1 << 16
MEDIA_TYPE = "image/vnd.radiance"

_HEADER = re.compile(rb"#\?[^\n]*\n((?:[^\n]+\n)*)\n([-+])([XY]) (\d{1,9}) ([-+])([XY]) (\d{1,9})\n")
_RUN_LENGTHS = range(8, 1 << 15)
"""Widths of lines that may be encoded by channels."""

Bytes = NDArray[np.uint8]


def recognises(content: bytes) -> bool:
    """Whether the content begins as a Radiance picture."""
    return content.startswith((b"#?RADIANCE", b"#?RGBE"))


def size_of(content: bytes) -> tuple[int, int]:
    """Width and height, pixels; AssetError for a damaged header."""
    head = _header(content)
    first, second = int(head[4]), int(head[7])
    return (second, first) if head[3] == b"Y" else (first, second)


def decode(content: bytes) -> DecodedImage:
    """Decode such a picture; AssetError if it is damaged, or stores no red, green and blue."""
    head = _header(content)
    codes = _lines(content[head.end() :], int(head[4]), int(head[7]))
    signs = {head[3]: head[2], head[6]: head[5]}
    if head[3] == b"X":
        codes = codes.swapaxes(0, 1)
    # Rows go down where Y decreases, columns to the right where X increases.
    down, right = -1 if signs[b"Y"] == b"+" else 1, -1 if signs[b"X"] == b"-" else 1
    codes = codes[::down, ::right]
    # An exponent of 0 is black, whatever the mantissas; ldexp would make denormal numbers of them.
    scale = np.where(codes[..., 3] > 0, np.ldexp(np.float32(1), codes[..., 3].astype(np.int32) - 136), 0)
    return of_light(codes[..., :3] * scale.astype(np.float32)[..., None])


def _header(content: bytes) -> re.Match[bytes]:
    head = _HEADER.match(content[:_LONGEST_HEADER])
    if head is None or head[3] == head[6] or 0 in (int(head[4]), int(head[7])):
        raise AssetError(DAMAGED)
    kind = re.search(rb"(?m)^FORMAT=\s*(\S*)", head[1])
    if kind is not None and kind[1] != b"32-bit_rle_rgbe":
        raise AssetError(
            "This Radiance picture stores CIE XYZ, not red, green and blue. Convert it with 'ra_xyze -r', or "
            "save it as EXR."
        )
    return head


def _lines(body: bytes, count: int, width: int) -> Bytes:
    """All lines (count, width, 4), each encoded in its own way."""
    data = np.frombuffer(body, np.uint8)
    # A line has two bytes for each channel at least, or one pixel: no more is allocated than that can fill.
    if data.size < 4 * count:
        raise AssetError(DAMAGED)
    lines = np.empty((count, width, 4), np.uint8)
    place = 0
    for line in lines:
        head = body[place : place + 4]
        if head[:2] == b"\2\2" and width in _RUN_LENGTHS and head[2:] == width.to_bytes(2, "big"):
            place = _by_channels(data, place + 4, line)
        else:
            place = _by_pixels(data, place, line)
    return lines


def _by_channels(data: Bytes, place: int, line: Bytes) -> int:
    """Fill a line (W, 4) from runs of each channel; gives the place after it."""
    for channel in line.T:
        filled = 0
        while filled < channel.size:
            code = int(data[place]) if place < data.size else 0
            is_run = code > 128
            length = code - 128 if is_run else code
            end = place + (2 if is_run else 1 + length)
            if length == 0 or filled + length > channel.size or end > data.size:
                raise AssetError(DAMAGED)
            channel[filled : filled + length] = data[place + 1 : end]
            filled, place = filled + length, end
    return place


def _by_pixels(data: Bytes, place: int, line: Bytes) -> int:
    """Fill a line (W, 4) from pixels, in which (1, 1, 1, n) repeats the one before n times.

    Such repetitions one after the other are the digits of a number to the base 256, the lowest first.
    """
    pixels = data[place : place + 4 * len(line)]
    pixels = pixels[: pixels.size // 4 * 4].reshape(-1, 4)
    repeats = (pixels[:, :3] == 1).all(axis=1)
    if pixels.size == 0 or repeats[0]:
        raise AssetError(DAMAGED)
    shown = np.flatnonzero(~repeats)
    owner = np.cumsum(~repeats) - 1
    digit = np.minimum(np.arange(len(pixels)) - shown[owner] - 1, 3)
    lengths = np.where(repeats, pixels[:, 3].astype(np.int64) << (8 * np.maximum(digit, 0)), 1)
    ends = np.cumsum(lengths)
    used = int(np.searchsorted(ends, len(line))) + 1
    if used > len(pixels) or ends[used - 1] != len(line):
        raise AssetError(DAMAGED)
    line[:] = np.repeat(pixels[shown[owner[:used]]], lengths[:used], axis=0)
    return place + 4 * used
