"""The binary form of tile events: ``GET /v1/jobs/{id}/tiles`` with ``Accept: application/octet-stream``.

All numbers are little-endian, and integers unsigned. A batch is a header of 20 bytes and its tiles:

| offset | bytes | meaning |
| --- | --- | --- |
| 0 | 4 | the letters `PNMB` |
| 4 | 2 | version of this format: 1 |
| 6 | 2 | encoding of the pixels: linear RGB in float32 (0) or float16 (2), or displayed RGB in 8 bits (1) |
| 8 | 4 | number of tiles |
| 12 | 4 | pass it as `after` to get what follows |
| 16 | 4 | bit 0: the job is final and nothing follows; bit 1: it succeeded |

Each tile is a header of 32 bytes, eight numbers of 4 bytes each: `seq`, `pass_index`, `x0`, `y0`, `x1`, `y1`,
`stride` and the `length` of the pixels in bytes; then its pixels, rows from the top, RGB by pixel:
ceil((y1 - y0) / stride) rows of ceil((x1 - x0) / stride) pixels.

The pixels are the mean of all samples so far. So a batch has each tile at most once, under the number of its
newest event, and omits it if a later event of the whole picture is in the batch. Paint the tiles in order
over the previous ones to get the newest picture.

>>> head = BatchHead(encoding=FLOAT32, tiles=1, next=7, complete=False, succeeded=False)
>>> tile = TileHead(seq=7, pass_index=1, x0=0, y0=0, x1=1, y1=1, stride=1, length=12)
>>> data = head.pack() + tile.pack() + bytes(12)
>>> got, [(its_head, pixels)] = unpack(data)
>>> got == head, its_head == tile, bytes(pixels) == bytes(12)
(True, True, True)
"""

from __future__ import annotations

import struct
from typing import NamedTuple

MEDIA_TYPE = "application/octet-stream"
MAGIC, VERSION = b"PNMB", 1
FLOAT32, RGB8, FLOAT16 = 0, 1, 2

_HEAD = struct.Struct("<4sHHIII")
_TILE = struct.Struct("<8I")


class BatchHead(NamedTuple):
    """The header of a batch, before its tiles."""

    encoding: int
    tiles: int
    next: int
    complete: bool
    succeeded: bool

    def pack(self) -> bytes:
        """Give the 20 bytes."""
        flags = self.complete | self.succeeded << 1
        return _HEAD.pack(MAGIC, VERSION, self.encoding, self.tiles, self.next, flags)


class TileHead(NamedTuple):
    """The header of a tile, before its pixels."""

    seq: int
    pass_index: int
    x0: int
    y0: int
    x1: int
    y1: int
    stride: int
    length: int

    def pack(self) -> bytes:
        """Give the 32 bytes."""
        return _TILE.pack(*self)


def unpack(data: bytes) -> tuple[BatchHead, list[tuple[TileHead, memoryview]]]:
    """Unpack a batch.

    Returns
    -------
    tuple
        The head, and each tile with its pixels, which are not copied.

    Raises
    ------
    ValueError
        If the bytes are not a whole batch of this version.
    """
    try:
        magic, version, encoding, count, following, flags = _HEAD.unpack_from(data)
        if (magic, version) != (MAGIC, VERSION):
            raise ValueError("These bytes are not a batch of tiles that this version reads.")
        tiles, offset = [], _HEAD.size
        for _ in range(count):
            head = TileHead(*_TILE.unpack_from(data, offset))
            offset += _TILE.size + head.length
            tiles.append((head, memoryview(data)[offset - head.length : offset]))
    except struct.error:
        raise ValueError("The batch of tiles ends too early.") from None
    if offset != len(data):
        raise ValueError("The batch of tiles is longer than its header states.")
    return BatchHead(encoding, count, following, bool(flags & 1), bool(flags & 2)), tiles
