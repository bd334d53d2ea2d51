"""PNG files of 16 bits a channel, which Pillow does not write."""

import struct
import zlib
from collections.abc import Iterable, Sequence
from typing import IO

import numpy as np
from numpy.typing import NDArray

_SIGNATURE = b"\x89PNG\r\n\x1a\n"
_TRUE_COLOR, _UP = 2, 2
_COMPRESSION = 4


def write_deep_png(file: IO[bytes], size: Sequence[int], bands: Iterable[NDArray[np.uint16]]) -> None:
    """Write a PNG file of 16 bits a channel (ISO 15948) from bands of rows, top to bottom.

    Each row is stored as its difference to the one above.

    Parameters
    ----------
    size
        Height and width, pixels.
    bands : iterable of (h, W, 3) uint16
    """
    height, width = size
    file.write(_SIGNATURE)
    _write_chunk(file, b"IHDR", struct.pack(">IIBBBBB", width, height, 16, _TRUE_COLOR, 0, 0, 0))
    packing = zlib.compressobj(_COMPRESSION)
    above = np.zeros((1, 6 * width), np.uint8)
    for band in bands:
        rows = band.astype(">u2").reshape(len(band), -1).view(np.uint8)
        lines = np.full((len(rows), 1 + 6 * width), _UP, np.uint8)
        lines[:, 1:] = rows - np.concatenate((above, rows[:-1]))
        above = rows[-1:]
        _write_chunk(file, b"IDAT", packing.compress(lines.tobytes()))
    _write_chunk(file, b"IDAT", packing.flush())
    _write_chunk(file, b"IEND", b"")


def _write_chunk(file: IO[bytes], kind: bytes, content: bytes) -> None:
    check = zlib.crc32(kind + content)
    file.write(struct.pack(">I", len(content)) + kind + content + struct.pack(">I", check))
