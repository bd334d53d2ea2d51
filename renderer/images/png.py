"""PNG files from bands of rows, of 8 or 16 bits: Pillow keeps 4 bytes of each pixel, and writes 8 bits."""

import struct
import zlib
from collections.abc import Iterable, Sequence
from typing import IO

import numpy as np
from numpy.typing import NDArray

_SIGNATURE = b"\x89PNG\r\n\x1a\n"
_TRUE_COLOR, _UP = 2, 2
_COMPRESSION = 4


def write_codes(
    file: IO[bytes], size: Sequence[int], bands: Iterable[NDArray[np.unsignedinteger]], bits: int = 8
) -> None:
    """Write a PNG file (ISO 15948) from bands of rows, top to bottom.

    Each row is stored as its difference to the one above.

    Parameters
    ----------
    size
        Height and width, pixels.
    bands : iterable of (h, W, 3)
        Codes from 0 to the largest of so many bits.
    bits : {8, 16}
        Of a channel.
    """
    height, width = size
    kind, length = np.dtype(f">u{bits // 8}"), 3 * width * bits // 8
    file.write(_SIGNATURE)
    _write_chunk(file, b"IHDR", struct.pack(">IIBBBBB", width, height, bits, _TRUE_COLOR, 0, 0, 0))
    packing = zlib.compressobj(_COMPRESSION)
    above = np.zeros((1, length), np.uint8)
    for band in bands:
        rows = band.astype(kind).reshape(len(band), -1).view(np.uint8)
        lines = np.full((len(rows), 1 + length), _UP, np.uint8)
        lines[:, 1:] = rows - np.concatenate((above, rows[:-1]))
        above = rows[-1:]
        _write_chunk(file, b"IDAT", packing.compress(lines.tobytes()))
    _write_chunk(file, b"IDAT", packing.flush())
    _write_chunk(file, b"IEND", b"")


def _write_chunk(file: IO[bytes], kind: bytes, content: bytes) -> None:
    check = zlib.crc32(kind + content)
    file.write(struct.pack(">I", len(content)) + kind + content + struct.pack(">I", check))
