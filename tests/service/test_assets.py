"""Textures: uploaded by content, checked before they are decoded, used by scenes."""

from __future__ import annotations

import hashlib
import io
import struct
import zlib
from pathlib import Path
from typing import Any

import httpx2
import numpy as np
import pytest
from PIL import Image

import renderer
from schemas.limits import Limits
from service.server import RunningServer
from service.storage.assets import AssetStore
from service.storage.folder import Folder
from tests.renderer.picture_files import deep_png, exr, hdr, tiff
from tests.service.support import ended, finish, image, scene, submit, wait
from tests.service.test_bad_requests import problem_of


def png(width: int = 4, height: int = 4) -> bytes:
    pixels = np.random.default_rng(width).integers(0, 256, (height, width, 3), np.uint8)
    file = io.BytesIO()
    Image.fromarray(pixels).save(file, "PNG")
    return file.getvalue()


def bomb(width: int, height: int) -> bytes:
    """A few bytes that say they are a large picture."""

    def chunk(kind: bytes, data: bytes) -> bytes:
        return struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))

    header = chunk(b"IHDR", struct.pack(">IIBBBBB", width, height, 8, 2, 0, 0, 0))
    return b"\x89PNG\r\n\x1a\n" + header + chunk(b"IDAT", zlib.compress(b"\0" * 1000)) + chunk(b"IEND", b"")


def put(client: httpx2.Client, data: bytes, sha256: str | None = None) -> httpx2.Response:
    return client.put(f"/v1/assets/{sha256 or hashlib.sha256(data).hexdigest()}", content=data)


def textured(asset: str) -> dict[str, Any]:
    document = scene()
    document["textures"] = {"a/b": {"type": "image", "asset": asset}}
    document["materials"]["floor"] = {"type": "phong", "color_texture": "a/b", "ambient": 0.2, "diffuse": 1.0}
    return document


def kept(server: RunningServer) -> set[str]:
    return {path.name for path in (server.data / "assets").iterdir()}


def test_an_asset_comes_back_as_it_was_sent(client: httpx2.Client) -> None:
    data = png(5, 7)
    sent = put(client, data)
    name = hashlib.sha256(data).hexdigest()
    expected = {
        "name": f"sha256:{name}",
        "bytes": len(data),
        "media_type": "image/png",
        "width": 5,
        "height": 7,
    }
    assert (sent.status_code, sent.json()) == (200, expected)
    assert put(client, data).json() == expected
    got = client.get(f"/v1/assets/{name}")
    assert (got.content, got.headers["Content-Type"]) == (data, "image/png")
    assert client.head(f"/v1/assets/{name}").status_code == 200
    assert client.get(f"/v1/assets/{name}", headers={"If-None-Match": got.headers["ETag"]}).status_code == 304


def turned() -> bytes:
    """A picture of 5 x 7 pixels that is stored on its side."""
    exif, file = Image.Exif(), io.BytesIO()
    exif[274] = 6
    Image.new("RGB", (7, 5)).save(file, "JPEG", exif=exif)
    return file.getvalue()


LIGHT = np.random.default_rng(3).random((7, 5), np.float32) * 2
DEEP = np.random.default_rng(3).integers(0, 1 << 16, (7, 5, 3))


@pytest.mark.parametrize(
    ("data", "media_type"),
    [
        (exr(dict.fromkeys("RGB", LIGHT)), "image/x-exr"),
        (hdr(DEEP.astype(np.uint8)[..., [0, 1, 2, 0]].tobytes(), "-Y 7 +X 5"), "image/vnd.radiance"),
        (b"Pf\n5 7\n-1\n" + LIGHT.tobytes(), "image/x-portable-anymap"),
        (deep_png(DEEP, 2), "image/png"),
        (tiff(DEEP.astype(np.uint16), ">", 2), "image/tiff"),
        (turned(), "image/jpeg"),
    ],
)
def test_every_kind_of_picture_is_recognised(client: httpx2.Client, data: bytes, media_type: str) -> None:
    sent = put(client, data).json()
    assert (sent["media_type"], sent["width"], sent["height"]) == (media_type, 5, 7)


@pytest.mark.parametrize(
    ("data", "said"),
    [(exr({"Z": LIGHT}), "no picture; its channels are Z"), (b"#?RADIANCE\n\n-Y 7", "damaged")],
)
def test_a_picture_that_cannot_be_used_is_refused_when_it_comes(
    client: httpx2.Client, data: bytes, said: str
) -> None:
    assert said in problem_of(put(client, data), 422)["detail"]


@pytest.mark.parametrize("data", [png(), exr(dict.fromkeys("RGB", LIGHT))], ids=["png", "exr"])
def test_a_scene_uses_an_uploaded_texture(client: httpx2.Client, server: RunningServer, data: bytes) -> None:
    document = textured(put(client, data).json()["name"])
    document["textures"]["a/b"]["encoding"] = "linear"
    job = submit(client, document)
    finish(client, job)
    assets = AssetStore(Folder(server.data / "assets"), Limits())
    plan = renderer.compile_scene(renderer.load_scene(document, assets=assets))
    assert image(client, job).tobytes() == renderer.render(plan, workers=1).image.tobytes()


@pytest.mark.parametrize("path", ["/v1/jobs", "/v1/plans"])
@pytest.mark.parametrize(
    ("asset", "code"),
    [("sha256:" + "0" * 64, "unknown_asset"), ("wood.png", "asset_name"), ("/etc/passwd", "asset_name")],
)
def test_a_missing_texture_is_pointed_at(client: httpx2.Client, path: str, asset: str, code: str) -> None:
    found = problem_of(client.post(path, json={"scene": textured(asset)}), 422)["errors"]
    assert [(one["pointer"], one["code"]) for one in found] == [("/scene/textures/a~1b/asset", code)]


def test_bytes_under_a_wrong_name_are_not_kept(client: httpx2.Client, server: RunningServer) -> None:
    before = kept(server)
    problem_of(put(client, png(), "ab" * 32), 422)
    problem_of(client.get(f"/v1/assets/{'ab' * 32}"), 404)
    assert kept(server) == before


@pytest.mark.parametrize("size", [(2000, 2000), (60_000, 60_000)])
def test_a_picture_with_too_many_pixels_is_refused_by_its_header(
    client: httpx2.Client, server: RunningServer, size: tuple[int, int]
) -> None:
    before = kept(server)
    assert problem_of(put(client, bomb(*size)), 422)["code"] == "upload_unusable"
    assert kept(server) == before


@pytest.mark.parametrize("data", [b"", b"hello", b"\x89PNG\r\n\x1a\n", b"<svg/>"])
def test_what_is_no_picture_is_refused(client: httpx2.Client, data: bytes) -> None:
    assert problem_of(put(client, data), 422)["code"] == "upload_unusable"


def test_a_damaged_picture_is_found_when_a_scene_uses_it(client: httpx2.Client) -> None:
    """A worker finds it: the server decodes nothing that users have sent."""
    asset = put(client, bomb(40, 40)).json()["name"]
    failure = wait(client, submit(client, textured(asset)), ended)["failure"]
    assert failure["code"] == "scene_not_usable"
    assert failure["message"].startswith("/scene/textures/a~1b/asset: ")


def test_a_file_that_is_too_long_is_refused(client: httpx2.Client, server: RunningServer) -> None:
    before = kept(server)
    problem_of(put(client, bytes(200_001)), 413)
    problem_of(client.put(f"/v1/assets/{'0' * 64}", content=iter([bytes(100_000)] * 3)), 413)
    assert kept(server) == before


@pytest.mark.parametrize("name", ["abc", "AB" * 32, "..%2F" * 12 + "abcd", "g" * 64])
def test_a_name_that_is_no_hash_is_refused(client: httpx2.Client, name: str) -> None:
    assert client.get(f"/v1/assets/{name}").status_code in {404, 422}
    assert client.put(f"/v1/assets/{name}", content=b"x").status_code in {404, 405, 422}


def test_an_asset_source_reads_nothing_but_assets(tmp_path: Path) -> None:
    (tmp_path / "secret").write_text("x")
    store = AssetStore(Folder(tmp_path / "assets"), Limits(max_image_pixels=100))
    for name in ("../secret", "sha256:../secret", "secret", "sha256:" + "0" * 64, "0" * 64):
        with pytest.raises(KeyError):
            store.read(name)
