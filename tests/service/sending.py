"""Files, scenes and keys that tests send, clients that send them, and the problems that come back."""

import hashlib
import io
import socket
import struct
import zlib
from pathlib import Path
from typing import Any

import httpx2
import numpy as np
from PIL import Image

from schemas.api.administration import Role
from service.access import keys
from service.server import RunningServer
from service.settings import Settings
from service.storage.database.connection import Database
from service.storage.database.migrations import upgrade
from tests.service.support import TIMEOUT, scene

JSON = {"Content-Type": "application/json"}
MARK = "e7a1-not-to-be-repeated"
"""No answer may repeat this part of a request."""
SMALL = {"scene": scene(16, 16, samples=1, light_samples=1)}


def problem_of(answer: httpx2.Response, status: int) -> dict[str, Any]:
    """The problem document of an answer, after what holds for all of them."""
    assert answer.status_code == status, answer.text
    assert answer.headers["Content-Type"] == "application/problem+json"
    document: dict[str, Any] = answer.json()
    assert document["status"] == status
    assert "Traceback" not in answer.text
    assert MARK not in answer.text
    return document


def mistakes(answer: httpx2.Response) -> list[tuple[str, str]]:
    """Pointer and code of each thing that is wrong with a request."""
    return [(one["pointer"], one["code"]) for one in problem_of(answer, 422)["errors"]]


def png(width: int = 4, height: int = 4) -> bytes:
    pixels = np.random.default_rng(width).integers(0, 256, (height, width, 3), np.uint8)
    file = io.BytesIO()
    Image.fromarray(pixels).save(file, "PNG")
    return file.getvalue()


def chunk(kind: bytes, data: bytes) -> bytes:
    """A chunk of a PNG file."""
    return struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))


def hollow_png(width: int, height: int, extra: bytes = b"") -> bytes:
    """A few bytes that say they are a picture of any size."""
    header = chunk(b"IHDR", struct.pack(">IIBBBBB", width, height, 8, 2, 0, 0, 0))
    body = header + extra + chunk(b"IDAT", zlib.compress(b"\0" * 1000))
    return b"\x89PNG\r\n\x1a\n" + body + chunk(b"IEND", b"")


def ply(announced: int = 4) -> bytes:
    """A tetrahedron in a binary PLY file, which may announce more triangles than it has."""
    corners = np.array([[1, 1, 1], [1, -1, -1], [-1, 1, -1], [-1, -1, 1]], "<f4") + np.float32([0, 1, 0])
    faces = b"".join(struct.pack("<B3i", 3, *face) for face in ([0, 1, 2], [0, 3, 1], [0, 2, 3], [1, 3, 2]))
    head = (
        "ply\nformat binary_little_endian 1.0\nelement vertex 4\nproperty float x\nproperty float y\n"
        f"property float z\nelement face {announced}\nproperty list uchar int vertex_indices\nend_header\n"
    )
    return head.encode() + corners.tobytes() + faces


DAMAGED = ply(announced=9)
"""A mesh that ends too early, which is found when it is read."""


def put(client: httpx2.Client, data: bytes, sha256: str | None = None) -> httpx2.Response:
    return client.put(f"/v1/assets/{sha256 or hashlib.sha256(data).hexdigest()}", content=data)


def name_of(data: bytes) -> str:
    """The name of a file in a scene."""
    return f"sha256:{hashlib.sha256(data).hexdigest()}"


def textured(asset: str) -> dict[str, Any]:
    document = scene()
    document["textures"] = {"a/b": {"type": "image", "asset": asset}}
    document["materials"]["floor"] = {"type": "phong", "color_texture": "a/b", "ambient": 0.2, "diffuse": 1.0}
    return document


def with_mesh(data: bytes) -> dict[str, Any]:
    document = scene()
    document["shapes"][1] = {"type": "mesh", "asset": name_of(data), "smooth": True, "material": "ball"}
    return document


def make_keys(data: Path, url: str | None = None, /, **roles: Role) -> dict[str, str]:
    """Make a key for each user, in the database of a data folder or another one."""
    database = Database(Settings(data=data, database=url).database_url)
    upgrade(database)
    with database.writing() as session:
        made = {user: str(keys.add(session, user, role)) for user, role in roles.items()}
    database.close()
    return made


def bearer(key: str) -> dict[str, str]:
    return {"Authorization": f"Bearer {key}"}


def client_of(server: RunningServer, key: str = "", address: str = "127.0.0.1") -> httpx2.Client:
    """A client of a server, perhaps with a key, at an address of this machine."""
    transport = httpx2.HTTPTransport(local_address=address)
    headers = bearer(key) if key else {}
    return httpx2.Client(base_url=server.url, transport=transport, headers=headers, timeout=TIMEOUT)


def connected(server: RunningServer, content: bytes = b"", address: str = "127.0.0.1") -> socket.socket:
    """A connection to a server on which something has been sent."""
    url = httpx2.URL(server.url)
    connection = socket.create_connection((url.host, url.port), TIMEOUT, (address, 0))
    connection.sendall(content)
    return connection
