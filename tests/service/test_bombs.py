"""Small files that unpack to gigabytes are refused by their headers, before memory is used."""

from __future__ import annotations

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
from PIL import Image, PngImagePlugin

from renderer.assets import AssetError
from renderer.meshes.gltf import opened
from schemas.limits import Limits
from service.server import RunningServer
from tests.service.support import scene
from tests.service.test_assets import bomb, put, textured
from tests.service.test_bad_requests import problem_of
from tests.service.test_meshes import FILES

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


def chunk(kind: bytes, data: bytes) -> bytes:
    return struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))


def with_chunk(kind: bytes, data: bytes) -> bytes:
    whole = bomb(4, 4)
    return whole[:33] + chunk(kind, data) + whole[33:]


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
    "a picture of 60,000 x 60,000 pixels": bomb(60_000, 60_000),
    "a picture of 2^31 x 2^31 pixels": bomb(2**31 - 1, 2**31 - 1),
    "a text that unpacks to 150 MB": with_chunk(b"iTXt", b"Comment\0\1\0\0\0" + zeros(150 * MIB)),
    "a colour profile that unpacks to 150 MB": with_chunk(b"iCCP", b"profile\0\0" + zeros(150 * MIB)),
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
def test_a_bomb_is_not_kept(client: httpx2.Client, content: bytes) -> None:
    assert len(content) < 200_000, "as long as the server of these tests takes"
    assert problem_of(put(client, content), 422)["code"] == "upload_unusable"


@pytest.mark.parametrize("kind", ["GIF", "PNG", "WEBP"])
def test_of_many_frames_none_is_decoded(client: httpx2.Client, kind: str) -> None:
    frames = [Image.new("P", (900, 900), color) for color in range(40)]
    file = io.BytesIO()
    frames[0].save(file, kind, save_all=True, append_images=frames[1:])
    assert len(file.getvalue()) < 200_000
    asset = put(client, file.getvalue())
    assert asset.status_code == 200, asset.text
    plan = client.post("/v1/plans", json={"scene": textured(asset.json()["name"])})
    assert plan.status_code == 200


def test_the_server_decodes_no_textures(client: httpx2.Client) -> None:
    """A hundred of a million pixels each, from one file of three kilobytes."""
    file = io.BytesIO()
    Image.new("RGB", (1000, 1000)).save(file, "PNG")
    name = put(client, file.getvalue()).json()["name"]
    document = scene()
    names = [f"t{number}" for number in range(100)]
    document["textures"] = {one: {"type": "image", "asset": name} for one in names}
    phong = {"type": "phong", "ambient": 0.2, "diffuse": 1.0}
    document["materials"] = {one: phong | {"color_texture": one} for one in names}
    ball = scene()["shapes"][1]
    document["shapes"] = [ball | {"material": one} for one in names]
    assert client.post("/v1/plans", json={"scene": document}).status_code == 200


def test_textures_that_no_worker_has_memory_for_are_refused_with_a_cure(client: httpx2.Client) -> None:
    file = io.BytesIO()
    Image.new("RGB", (1000, 1000)).save(file, "PNG")
    name = put(client, file.getvalue()).json()["name"]
    names = [f"{kind}{number}" for number in range(100) for kind in "ab"]
    document = scene()
    document["textures"] = {one: {"type": "image", "asset": name} for one in names}
    phong = {"type": "phong", "ambient": 0.2, "diffuse": 1.0}
    document["materials"] = {
        str(number): phong | {"color_texture": f"a{number}", "normal_map": f"b{number}"}
        for number in range(100)
    }
    ball = scene()["shapes"][1]
    document["shapes"] = [ball | {"material": str(number)} for number in range(100)]
    assert client.post("/v1/plans", json={"scene": document}).status_code == 200
    request = {"scene": document, "quality": {"mode": "target", "error": 0.01}}
    (found,) = problem_of(client.post("/v1/plans", json=request), 422)["errors"]
    assert (found["pointer"], found["code"]) == ("/scene/textures/a0/asset", "too_large")
    assert "worker_memory_bytes" in found["detail"]


def test_a_mesh_that_is_used_often_is_not_read_as_often(client: httpx2.Client) -> None:
    name = put(client, FILES["ply binary"]()).json()["name"]
    document = scene()
    document["shapes"] = [{"type": "mesh", "asset": name, "material": "ball", "smooth": True}] * 100
    assert client.post("/v1/plans", json={"scene": document}).status_code == 200


def test_a_picture_is_no_mesh_and_a_mesh_no_picture(client: httpx2.Client) -> None:
    picture, mesh = (put(client, data).json()["name"] for data in (bomb(4, 4), FILES["ply binary"]()))
    document = textured(mesh)
    document["shapes"].append({"type": "mesh", "asset": picture, "material": "ball"})
    found = problem_of(client.post("/v1/plans", json={"scene": document}), 422)["errors"]
    assert [(one["pointer"], one["code"]) for one in found] == [
        ("/scene/textures/a~1b/asset", "asset"),
        ("/scene/shapes/2/asset", "asset"),
    ]


def test_a_long_description_is_not_parsed() -> None:
    with pytest.raises(AssetError, match="description"):
        opened(glb(described() | {"extras": "x" * 9 * MIB}), Limits().max_mesh_triangles)


def test_texts_of_a_picture_are_no_part_of_it(client: httpx2.Client) -> None:
    texts = PngImagePlugin.PngInfo()
    texts.add_text("Comment", "harmless " * 1000, zip=True)
    file = io.BytesIO()
    Image.new("RGB", (4, 4)).save(file, "PNG", pnginfo=texts)
    assert put(client, file.getvalue()).status_code == 200
