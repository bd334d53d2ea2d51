"""``--tev``: shows the picture of a running job in the viewer tev."""

from __future__ import annotations

import re
import socket
import struct
from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from typing import TYPE_CHECKING, Annotated, Any

import typer

from service.cli import output
from service.cli.errors import CommandError

if TYPE_CHECKING:
    import numpy.typing as npt

    from service.client import Client

_ADDRESS = re.compile(r"(?:\[(?P<v6>[^\]]+)\]|(?P<host>[^:\[\]]+))(?::(?P<port>\d{1,5}))?")
LARGEST_PORT = 65535
DEFAULT_PORT = 14158
TIMEOUT_SECONDS = 5.0
"""Seconds for tev to accept a connection or a packet. It runs on this machine, or close to it."""

_CREATE_IMAGE = 4
_UPDATE_IMAGE = 6
"""Version 3: each channel has an offset and a stride in the data."""
_CHANNELS = ("R", "G", "B")

TevOption = Annotated[
    str | None,
    typer.Option(
        metavar="HOST:PORT",
        help="Show the picture in the viewer tev that runs there; its usual port is 14158.",
        show_default=False,
    ),
]


@dataclass(slots=True)
class Mirror:
    """Sends the tiles of a job to tev; if tev closes, it says so once and stops sending.

    Attributes
    ----------
    address
        The address of `viewer` as the user gave it.
    seen
        Number of the last tile sent.
    """

    client: Client
    job_id: str
    viewer: socket.socket | None
    address: str
    seen: int = 0

    @property
    def name(self) -> str:
        """The name of the picture in tev."""
        return f"penumbra {self.job_id}"

    def open(self) -> None:
        """Open a black picture of the job's size."""
        job = self.client.get(self.job_id)
        self._send([create_image(self.name, job.width, job.height)])

    def show(self) -> None:
        """Send all tiles that are new."""
        more = True
        while more and self.viewer is not None:
            batch = self.client.tile_pixels(self.job_id, after=self.seen)
            more = batch.next > self.seen and not batch.complete
            self.seen = batch.next
            self._send(
                update_image(self.name, tile.head.x0, tile.head.y0, tile.enlarged()) for tile in batch.tiles
            )

    def _send(self, packets: Iterable[bytes]) -> None:
        try:
            for packet in packets:
                if self.viewer is not None:
                    self.viewer.sendall(packet)
        except OSError as error:
            self.viewer = None
            output.say(
                f"tev at {self.address} disconnected ({_reason(error)}). Watching continues without it."
            )


def parsed(address: str) -> tuple[str, int]:
    """Host and port of an address; CommandError if it is not one.

    >>> parsed("studio"), parsed("[::1]:4000")
    (('studio', 14158), ('::1', 4000))
    """
    match = _ADDRESS.fullmatch(address)
    port = int(match["port"] or DEFAULT_PORT) if match else 0
    if match is None or not 0 < port <= LARGEST_PORT:
        raise CommandError(
            f"{address!r} is not an address of tev. Write HOST:PORT, such as 127.0.0.1:{DEFAULT_PORT}."
        )
    return match["v6"] or match["host"], port


@contextmanager
def mirror(client: Client, job_id: str, address: str | None) -> Iterator[Mirror | None]:
    """A mirror in the viewer at an address; None without one, and, with a message, where none listens."""
    viewer = None if address is None else _connected(address)
    if viewer is None or address is None:
        yield None
        return
    with viewer:
        made = Mirror(client, job_id, viewer, address)
        made.open()
        yield made


def _connected(address: str) -> socket.socket | None:
    place = parsed(address)
    try:
        return socket.create_connection(place, timeout=TIMEOUT_SECONDS)
    except OSError as error:
        output.say(
            f"tev cannot be reached at {address} ({_reason(error)}). Start it there with IPC enabled. "
            "Watching continues without it."
        )
        return None


def _reason(error: OSError) -> str:
    return error.strerror or str(error) or type(error).__name__


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
    import numpy as np

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
