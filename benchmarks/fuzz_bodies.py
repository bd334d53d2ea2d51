"""Malformed bodies: mutated scenes, random JSON, truncated text, files."""

import base64
import copy
import io
import json
import random
import struct
import zlib
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from PIL import Image

import scenes

GALLERY = Path(str(scenes.__file__)).parent / "gallery"
NUMBERS = (
    0, -0.0, 1, -1, 2, 0.5, 255, 256, 65535, 65536, 2**31 - 1, 2**31, 2**53 + 1, -(2**63), 2**64,
    10**308, 1e-320, 5e-324, 1e15, 1e16, 1e30, -1e30, 1e200, 1.7976931348623157e308,
)  # fmt: skip
"""Values at which fields begin, end, or lose their digits."""
TEXTS = (
    "", "a", "\u0000", "\ud800", "\u202e", "x" * 300, "../../etc/passwd", "/etc/passwd", "file:///etc/passwd",
    "http://127.0.0.1:1/", "sha256:" + "0" * 64, "sha256:" + "g" * 64, "__class__", "{0.__class__}", "%s%n",
    "'; DROP TABLE jobs; --", "${jndi:ldap://x}", "NaN", "1", "true", "\U0001f4a9", "e\u0301" * 20,
)  # fmt: skip
VERBATIM = ("NaN", "Infinity", "-Infinity", "1e999", "-1e999", "1" * 400, "0." + "1" * 400, "1e-999", "-0")
"""Numbers that JSON text may have and Python's writer does not write."""
PLACE = "?verbatim?"


def gallery() -> list[dict[str, Any]]:
    """Scenes of the gallery that need no files, with few pixels and samples."""
    one = {"pattern": "uniform", "samples": 1}
    found = []
    for path in sorted(GALLERY.glob("*.json")):
        document = json.loads(path.read_text())
        if '"asset"' not in path.read_text() and isinstance(document.get("camera"), dict):
            document["camera"] |= {"width": 16, "height": 12}
            found.append(document | {"sampling": {"antialiasing": one, "light": one}})
    return found


class Bodies:
    """Makes bodies, always the same ones of the same source of random numbers."""

    def __init__(self, source: random.Random) -> None:
        self.random = source
        self._scenes = gallery()

    def body(self, route: str) -> bytes:
        """The next body for a route."""
        if route == "assets":
            return self.file()
        kinds = {"quotes": self.quote, "traces": self.trace, "comparisons": self.comparison}
        request = kinds.get(route, self.place if "{}" in route else self.job)()
        if self.random.random() < 0.1:
            self.wound(request)
        return self.written(request)

    def scene(self) -> dict[str, Any]:
        """A scene of the gallery with up to four wounds."""
        document: dict[str, Any] = copy.deepcopy(self.random.choice(self._scenes))
        for _ in range(self.random.choice((0, 0, 1, 1, 1, 2, 3, 4))):
            self.wound(document)
        return document

    def wound(self, document: Any) -> None:
        """Change one place of a document."""
        holder, key = self.random.choice(list(_places(document)))
        kind = self.random.randrange(8)
        if kind == 0:
            del holder[key]
        elif kind == 1 and isinstance(holder, dict):
            holder[self.text()] = holder.pop(key)
        elif kind == 2 and isinstance(holder, list):
            holder.extend([holder[key]] * self.random.choice((1, 3, 40)))
        elif kind == 3:
            holder[key] = [holder[key]]
        elif kind == 4:
            other, place = self.random.choice(list(_places(document)))
            holder[key] = copy.deepcopy(other[place])
        elif kind == 5 and isinstance(holder[key], int | float):
            holder[key] = holder[key] * self.random.choice((-1, 0, 1e-9, 1e9, 1e300))
        else:
            holder[key] = self.value()

    def value(self, depth: int = 3) -> Any:
        """Any JSON value."""
        kind = self.random.randrange(9 if depth else 6)
        if kind in {0, 1}:
            return self.random.choice(NUMBERS)
        if kind == 2:
            return self.random.choice((None, True, False))
        if kind == 3:
            return self.random.uniform(-10, 10)
        if kind == 4:
            return PLACE + self.random.choice(VERBATIM)
        if kind == 5:
            return self.text()
        if kind == 6:
            return {self.text(): self.value(depth - 1) for _ in range(self.random.randrange(4))}
        return [self.value(depth - 1) for _ in range(self.random.randrange(5))]

    def text(self) -> str:
        """A text that means something somewhere."""
        return self.random.choice(TEXTS)

    def written(self, document: Any) -> bytes:
        """The document as JSON text, sometimes truncated."""
        text = json.dumps(document, ensure_ascii=self.random.random() < 0.5)
        for number in VERBATIM:
            text = text.replace(f'"{PLACE}{number}"', number)
        data = text.encode("utf-8", "surrogatepass")
        return self.torn(data) if self.random.random() < 0.15 else data

    def torn(self, data: bytes) -> bytes:
        """The same bytes with something wrong in the middle."""
        at = self.random.randrange(len(data) + 1)
        kind = self.random.randrange(5)
        if kind == 0:
            return data[:at]
        if kind == 1:
            return data[:at] + self.random.randbytes(self.random.randrange(1, 30)) + data[at + 1 :]
        if kind == 2:
            return data[:at] + data[at - self.random.randrange(1, 40) :]
        if kind == 3:
            more = (b"[", b"{", b'"', b",", b"\\u", b"\x00", b"\xff")
            return data[:at] + self.random.choice(more) + data[at:]
        return data.replace(b":", b':{"a":' * self.random.choice((1, 70, 5000)), 1)

    def job(self) -> dict[str, Any]:
        """A request for a job."""
        request = {"scene": self.scene() if self.random.random() < 0.93 else self.value()}
        if self.random.random() < 0.3:
            request["quality"] = self.quality()
            request["layers"] = self.random.choice((["depth"], ["error"], [], "x"))
        if self.random.random() < 0.1:
            request |= {"labels": {self.text(): self.text()}, "priority": self.value(0)}
        return request

    def quality(self) -> Any:
        """A requested quality."""
        number = self.random.choice(NUMBERS)
        fixed = {"mode": "fixed", "antialiasing": {"pattern": "random", "samples": number}}
        target = {"mode": "target", "error": self.random.choice((0.05, 0.1, number)), "time_limit": 1}
        return self.random.choice((fixed, target, self.value()))

    def quote(self) -> dict[str, Any]:
        """A request for a quote."""
        return {"scene": self.scene(), "target_error": self.random.choice((0.05, *NUMBERS))}

    def trace(self) -> dict[str, Any]:
        """Rays and a scene."""
        count = self.random.choice((0, 1, 2, 5))
        rays = [[self.random.choice((*NUMBERS[:8], 0.3, -0.7)) for _ in range(3)] for _ in range(2 * count)]
        return {"scene": self.scene(), "origins": rays[:count], "directions": rays[count:]}

    def comparison(self) -> dict[str, Any]:
        """Two pictures, or what is said to be."""
        sides = [
            {"content": base64.b64encode(self.file()).decode()}
            if self.random.random() < 0.8
            else {self.random.choice(("job", "content")): self.value(1)}
            for _ in range(2)
        ]
        return {"image": sides[0], "reference": sides[1]}

    def place(self) -> dict[str, Any]:
        """A pixel, or a rectangle of a picture."""
        names = self.random.choice((("x", "y"), ("x0", "y0", "x1", "y1")))
        return {name: self.random.choice((*NUMBERS, 3, 5, 8)) for name in names}

    def file(self) -> bytes:
        """A texture or a mesh, mostly wounded."""
        data = self.random.choice((_picture, _png, _ply, _obj, _glb, _npy))(self.random)
        return self.torn(data) if self.random.random() < 0.7 else data


def _places(node: Any) -> Iterator[tuple[Any, Any]]:
    """Every object and array of a document with each of its keys; the document must have one."""
    keys = list(node) if isinstance(node, dict) else range(len(node)) if isinstance(node, list) else ()
    for key in keys:
        yield node, key
        yield from _places(node[key])


def _picture(source: random.Random) -> bytes:
    size = source.choice(((4, 4), (5, 3)))
    file = io.BytesIO()
    Image.frombytes("RGB", size, source.randbytes(3 * size[0] * size[1])).save(file, "PNG")
    return file.getvalue()


def _png(source: random.Random) -> bytes:
    def chunk(kind: bytes, data: bytes) -> bytes:
        return struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))

    width, height = (source.choice((0, 1, 4, 5000, 2**31 - 1)) for _ in range(2))
    header = struct.pack(">IIBBBBB", width, height, source.choice((1, 8, 16)), source.randrange(8), 0, 0, 0)
    extra = chunk(source.choice((b"iTXt", b"zTXt", b"iCCP", b"tRNS", b"gAMA")), source.randbytes(20))
    return (
        b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", header) + extra + chunk(b"IDAT", zlib.compress(bytes(200)))
        + chunk(b"IEND", b"")
    )  # fmt: skip


def _ply(source: random.Random) -> bytes:
    count = source.choice((0, 1, 3, 10**7, 10**20))
    return (
        f"ply\nformat ascii 1.0\nelement vertex {count}\n"
        "property float x\nproperty float y\nproperty float z\n"
        "element face 1\nproperty list uchar int vertex_indices\nend_header\n0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n"
    ).encode()


def _obj(source: random.Random) -> bytes:
    number = source.choice(("1", "nan", "1e999", "x", "-1"))
    return f"v 0 0 0\nv 1 0 0\nv 0 {number} 0\nf 1 2 {source.choice((3, 4, -1, 10**9))}\n".encode()


def _glb(source: random.Random) -> bytes:
    document = {
        "asset": {"version": "2.0"},
        "nodes": [{"mesh": source.choice((0, 1, -1, "0"))}],
        "meshes": [{"primitives": [{"attributes": {"POSITION": 0}}]}],
        "accessors": [
            {"bufferView": 0, "componentType": 5126, "count": source.choice(NUMBERS), "type": "VEC3"}
        ],
        "bufferViews": [{"buffer": 0, "byteLength": 36}],
        "buffers": [{"byteLength": source.choice(NUMBERS)}],
    }
    text = json.dumps(document).encode()
    text += b" " * (-len(text) % 4)
    length = source.choice((len(text), 0, 2**32 - 1))
    return struct.pack("<4sIIII", b"glTF", 2, 20 + len(text), length, 0x4E4F534A) + text


def _npy(source: random.Random) -> bytes:
    shape = source.choice(((2, 2, 3), (10**6, 10**6, 3), (-1, 2, 3), ()))
    header = f"{{'descr': '{source.choice(('<f4', '|O', '<f8'))}', 'fortran_order': False, 'shape': {shape}}}"
    text = header.encode() + b" " * 10 + b"\n"
    return b"\x93NUMPY\x01\x00" + struct.pack("<H", len(text)) + text + bytes(48)
