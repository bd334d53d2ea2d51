"""Small files that unpack to gigabytes are refused by their headers, before memory is used."""

import io
import json
import struct
import zlib
from collections.abc import Iterator
from functools import cache
from pathlib import Path
from typing import Any

import httpx2
import pytest
from PIL import Image

from service.server import RunningServer
from tests.service.sending import chunk, hollow_png, mistakes, ply, problem_of, put, textured
from tests.service.support import scene

MIB = 1024 * 1024
# Less than the smallest of the bombs would take, more than a server needs for a request.
ALLOWED = 96 * MIB


@pytest.fixture(autouse=True)
def no_memory_is_taken(server: RunningServer) -> Iterator[None]:
    process = Path(f"/proc/{server.process.pid}")
    (process / "clear_refs").write_text("5")
    before = _peak(process)
    yield
    assert _peak(process) - before < ALLOWED


def _peak(process: Path) -> int:
    """Most memory of a process since its peak was reset, bytes."""
    lines = (process / "status").read_text().splitlines()
    return next(int(line.split()[1]) for line in lines if line.startswith("VmHWM")) * 1024


@cache
def zeros(count: int) -> bytes:
    """Compressed by about a thousand."""
    packer = zlib.compressobj(9)
    return b"".join(packer.compress(bytes(MIB)) for _ in range(count // MIB)) + packer.flush()


def glb(document: dict[str, Any] | bytes) -> bytes:
    text = document if isinstance(document, bytes) else json.dumps(document).encode()
    text += b" " * (-len(text) % 4)
    head = struct.pack("<4sIIII", b"glTF", 2, 20 + len(text), len(text), 0x4E4F534A)
    return head + text


def described(count: object = 3, **buffer: object) -> dict[str, Any]:
    return {
        "asset": {"version": "2.0"},
        "nodes": [{"mesh": 0}],
        "meshes": [{"primitives": [{"attributes": {"POSITION": 0}}]}],
        "accessors": [{"bufferView": 0, "componentType": 5126, "count": count, "type": "VEC3"}],
        "bufferViews": [{"buffer": 0, "byteLength": 36}],
        "buffers": [{"byteLength": 36} | buffer],
    }


PLY = "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nelement face {}\nend_header\n"
BOMBS = {
    "a picture of 2^31 x 2^31 pixels": hollow_png(2**31 - 1, 2**31 - 1),
    "a text that unpacks to 150 MB": hollow_png(
        4, 4, chunk(b"iTXt", b"Comment\0\1\0\0\0" + zeros(150 * MIB))
    ),
    "a colour profile that unpacks to 150 MB": hollow_png(
        4, 4, chunk(b"iCCP", b"profile\0\0" + zeros(150 * MIB))
    ),
    "a mesh of 10^12 triangles": PLY.format(10**12).encode(),
    "a mesh whose number of triangles has 5,000 digits": PLY.format("9" * 5000).encode(),
    "a mesh of 10^300 vertices": glb(described(10**300)),
    "a mesh of infinitely many vertices": glb(json.dumps(described("?")).replace('"?"', "1e999").encode()),
    "a mesh of fewer than no vertices": glb(described(-(10**9))),
    "a description 50,000 deep": glb(b'{"asset":' + b"[" * 50_000 + b"]" * 50_000 + b"}"),
    "a mesh in another file": glb(described(uri="file:///etc/passwd")),
    "a mesh elsewhere": glb(described(uri="http://127.0.0.1:9/mesh.bin")),
    "a mesh of many views of the same bytes": glb(
        described()
        | {
            "accessors": [described()["accessors"][0] | {"bufferView": view} for view in range(1000)],
            "bufferViews": [{"buffer": 0, "byteLength": 1 << 20}] * 1000,
            "meshes": [{"primitives": [{"attributes": {"POSITION": view}} for view in range(1000)]}],
        }
    ),
}


@pytest.mark.parametrize("content", BOMBS.values(), ids=BOMBS)
def test_bomb_is_not_kept(client: httpx2.Client, content: bytes) -> None:
    assert len(content) < 200_000, "as long as the server of these tests takes"
    assert problem_of(put(client, content), 422)["code"] == "upload_unusable"


@pytest.mark.parametrize("kind", ["GIF", "PNG", "WEBP"])
def test_frames_of_a_moving_picture_are_not_decoded(client: httpx2.Client, kind: str) -> None:
    frames = [Image.new("P", (900, 900), color) for color in range(40)]
    file = io.BytesIO()
    frames[0].save(file, kind, save_all=True, append_images=frames[1:])
    asset = put(client, file.getvalue())
    assert asset.status_code == 200, asset.text
    plan = client.post("/v1/plans", json={"scene": textured(asset.json()["name"])})
    assert plan.status_code == 200


def test_textures_are_not_decoded_by_the_server_and_fit_into_a_worker(client: httpx2.Client) -> None:
    """A hundred of a million pixels each for colours, and the same for normals, from files of 100 bytes."""
    files = (hollow_png(1000, 1000, chunk(b"tEXt", b"Number\0%d" % number)) for number in range(100))
    names = [put(client, file).json()["name"] for file in files]
    document = scene()
    document["textures"] = {
        str(number): {"type": "image", "asset": name} for number, name in enumerate(names)
    }
    phong = {"type": "phong", "ambient": 0.2, "diffuse": 1.0}
    document["materials"] = {
        one: phong | {"color_texture": one, "normal_map": one} for one in document["textures"]
    }
    ball = scene()["shapes"][1]
    document["shapes"] = [ball | {"material": one} for one in document["textures"]]
    assert client.post("/v1/plans", json={"scene": document}).status_code == 200
    for texture in document["textures"].values():
        texture["filter"] = "mipmap"
    too_large = [("/scene/textures/0/asset", "too_large")]
    assert mistakes(client.post("/v1/plans", json={"scene": document})) == too_large
    # What is the same by any other name is read once.
    for texture in document["textures"].values():
        texture["asset"] = names[0]
    assert client.post("/v1/plans", json={"scene": document}).status_code == 200


@pytest.mark.slow
def test_mesh_that_is_used_often_is_not_read_as_often(client: httpx2.Client) -> None:
    name = put(client, ply()).json()["name"]
    document = scene()
    document["shapes"] = [{"type": "mesh", "asset": name, "material": "ball", "smooth": True}] * 100
    assert client.post("/v1/plans", json={"scene": document}).status_code == 200
