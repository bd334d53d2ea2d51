"""A server that decodes packets by tev's published layout."""

import socket
import struct
import threading
from dataclasses import dataclass, field
from typing import Any

import numpy as np
import numpy.typing as npt

OPEN, RELOAD, CLOSE, UPDATE, CREATE, UPDATE_V2, UPDATE_V3, OPEN_V2 = range(8)


@dataclass
class Fields:
    """The fields of one packet, read one after another."""

    data: bytes
    place: int = 0

    def number(self, code: str) -> Any:
        (value,) = struct.unpack_from("<" + code, self.data, self.place)
        self.place += struct.calcsize("<" + code)
        return value

    def text(self) -> str:
        end = self.data.index(b"\0", self.place)
        found = self.data[self.place : end].decode()
        self.place = end + 1
        return found


@dataclass
class TevServer:
    """Listens as tev does, and keeps pictures by name.

    It closes the connection after `packets` of them, where that is given.
    """

    packets: int | None = None
    images: dict[str, dict[str, npt.NDArray[np.float32]]] = field(default_factory=dict)
    kinds: list[int] = field(default_factory=list)

    def __post_init__(self) -> None:
        self.listener = socket.create_server(("127.0.0.1", 0))
        self.address = f"127.0.0.1:{self.listener.getsockname()[1]}"
        self.thread = threading.Thread(target=self._serve, daemon=True)
        self.thread.start()

    def close(self) -> None:
        """Wait until what was sent is read, by a connection that may not have been taken yet."""
        self.thread.join(timeout=10)
        self.listener.close()
        assert not self.thread.is_alive()

    def picture(self, name: str) -> npt.NDArray[np.float32]:
        """A picture, (height, width, 3)."""
        channels = self.images[name]
        assert list(channels) == ["R", "G", "B"]
        return np.stack(list(channels.values()), axis=2)

    def _serve(self) -> None:
        connection, _ = self.listener.accept()
        with connection, connection.makefile("rb") as stream:
            while (head := stream.read(4)) and (self.packets is None or len(self.kinds) < self.packets):
                # The length counts its own four bytes.
                (length,) = struct.unpack("<I", head)
                self._take(Fields(stream.read(length - 4)))

    def _take(self, fields: Fields) -> None:
        kind = fields.number("b")
        self.kinds.append(kind)
        assert fields.number("b") in {0, 1}
        name = fields.text()
        if kind == CREATE:
            width, height, count = (fields.number("i") for _ in range(3))
            channels = [fields.text() for _ in range(count)]
            self.images[name] = {channel: np.zeros((height, width), np.float32) for channel in channels}
        elif kind in {UPDATE, UPDATE_V2, UPDATE_V3}:
            self._update(kind, name, fields)
        assert fields.place == len(fields.data)

    def _update(self, kind: int, name: str, fields: Fields) -> None:
        count = fields.number("i") if kind >= UPDATE_V2 else 1
        channels = [fields.text() for _ in range(count)]
        x, y, width, height = (fields.number("i") for _ in range(4))
        pixels = width * height
        offsets, strides = [pixels * number for number in range(count)], [1] * count
        if kind == UPDATE_V3:
            offsets = [fields.number("q") for _ in range(count)]
            strides = [fields.number("q") for _ in range(count)]
        most = max(
            offset + (pixels - 1) * stride + 1 for offset, stride in zip(offsets, strides, strict=True)
        )
        data = np.frombuffer(fields.data, "<f4", most, fields.place)
        fields.place += data.nbytes
        for channel, offset, stride in zip(channels, offsets, strides, strict=True):
            part = data[offset : offset + (pixels - 1) * stride + 1 : stride]
            self.images[name][channel][y : y + height, x : x + width] = part.reshape(height, width)
