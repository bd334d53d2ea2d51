"""Showing pictures in tev, the image viewer, while they grow.

tev listens for packets on TCP, by default on port 14158. A packet is its length in bytes, these four
included, its kind in one byte, and its fields one after another: numbers little-endian, truth values in one
byte, texts in UTF-8 ended by a zero. Source: `include/tev/Ipc.h` and `src/Ipc.cpp` of tev 2.
"""

from __future__ import annotations

import socket
import struct
from types import TracebackType
from typing import Any, Self

import numpy as np
import numpy.typing as npt

DEFAULT_PORT = 14158
PATIENCE = 5.0
"""Seconds that tev may take to accept a connection or a packet: it runs on this machine, or near it."""

_CREATE_IMAGE = 4
_UPDATE_IMAGE = 6
"""The third form of it: each channel has a place of its own in the data."""
_CHANNELS = ("R", "G", "B")


def create_image(name: str, width: int, height: int) -> bytes:
    """The packet that opens a black picture.

    >>> create_image("a", 2, 1).hex(" ", -4)
    '1a000000 04016100 02000000 01000000 03000000 52004700 4200'
    """
    fields = struct.pack("<3i", width, height, len(_CHANNELS)) + _texts(*_CHANNELS)
    return _packet(_CREATE_IMAGE, b"\1" + _texts(name) + fields)


def update_image(name: str, x: int, y: int, pixels: npt.NDArray[Any]) -> bytes:
    """The packet that paints a rectangle of an open picture.

    Parameters
    ----------
    x, y
        Its corner on the upper left, pixels.
    pixels
        Shape (height, width, 3), linear RGB.
    """
    height, width, count = pixels.shape
    channels = struct.pack("<i", count) + _texts(*_CHANNELS)
    place = struct.pack("<4i", x, y, width, height)
    offsets_and_strides = struct.pack(f"<{2 * count}q", *range(count), *[count] * count)
    data = np.ascontiguousarray(pixels, dtype="<f4").tobytes()
    return _packet(_UPDATE_IMAGE, b"\0" + _texts(name) + channels + place + offsets_and_strides + data)


def _packet(kind: int, fields: bytes) -> bytes:
    return struct.pack("<IB", 5 + len(fields), kind) + fields


def _texts(*texts: str) -> bytes:
    return b"".join(text.encode() + b"\0" for text in texts)


class Viewer:
    """A connection to tev.

    Parameters
    ----------
    host, port
        Where it listens.

    Raises
    ------
    OSError
        It does not.
    """

    def __init__(self, host: str, port: int) -> None:
        self._socket = socket.create_connection((host, port), timeout=PATIENCE)

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        traceback: TracebackType | None,
    ) -> None:
        self._socket.close()

    def send(self, packet: bytes) -> None:
        """Send a packet; OSError where tev has gone, or takes nothing."""
        self._socket.sendall(packet)
