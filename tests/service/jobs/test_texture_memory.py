"""Textures and meshes that are admitted fit into the memory of a worker, whatever their files are."""

import io
import struct
from collections.abc import Callable, Iterator

import httpx2
import numpy as np
import pytest
from PIL import Image

from renderer.images.png import write_codes
from service.settings import Settings
from tests.service.forking import running
from tests.service.sending import hollow_png, put, textured, with_mesh
from tests.service.support import TIMEOUT, finish, submit

pytestmark = pytest.mark.slow

MEMORY = 1 << 30
SIDES = range(2000, 8000, 250)


@pytest.fixture(scope="module")
def client(tmp_path_factory: pytest.TempPathFactory) -> Iterator[httpx2.Client]:
    settings = Settings(
        data=tmp_path_factory.mktemp("small"),
        port=0,
        workers=1,
        worker_memory_bytes=MEMORY,
        log_level="error",
    )
    with running(settings) as server, httpx2.Client(base_url=server.url, timeout=TIMEOUT) as opened:
        yield opened


def filtered(name: str, kind: str) -> dict[str, object]:
    document = textured(name)
    document["textures"]["a/b"]["filter"] = kind
    return document


def largest(client: httpx2.Client, kind: str) -> int:
    """Side of the largest texture with a filter that is admitted."""

    def admitted(side: int) -> bool:
        name = put(client, hollow_png(side, side)).json()["name"]
        return client.post("/v1/plans", json={"scene": filtered(name, kind)}).status_code == 200

    return max(side for side in SIDES if admitted(side))


def by_pillow(kind: str, mode: str = "RGB", **options: object) -> Callable[[int], bytes]:
    def written(side: int) -> bytes:
        file = io.BytesIO()
        Image.radial_gradient("L").resize((side, side)).convert(mode).save(file, kind, **options)
        return file.getvalue()

    return written


def deep_png(side: int) -> bytes:
    file = io.BytesIO()
    row = np.linspace(0, 65535, 3 * side).astype(np.uint16).reshape(1, side, 3)
    write_codes(file, (side, side), (row for _ in range(side)), bits=16)
    return file.getvalue()


FILES: dict[str, Callable[[int], bytes]] = {
    "png": by_pillow("PNG", compress_level=1),
    "png with alpha": by_pillow("PNG", "RGBA", compress_level=1),
    "png of 16 bits": deep_png,
    "tiff with lzw": by_pillow("TIFF", compression="tiff_lzw"),
    "webp": by_pillow("WEBP", lossless=True, quality=0, method=0),
    "jpeg": by_pillow("JPEG"),
    "gif": by_pillow("GIF", "P"),
}


def ply_of(copies: int) -> bytes:
    """So many copies of one triangle."""
    head = (
        "ply\nformat binary_little_endian 1.0\nelement vertex 3\nproperty float x\nproperty float y\n"
        f"property float z\nelement face {copies}\nproperty list uchar int vertex_indices\nend_header\n"
    )
    corners = np.array([[-1, 0, 0], [1, 0, 0], [0, 1.5, 0]], "<f4")
    return head.encode() + corners.tobytes() + struct.pack("<B3i", 3, 0, 1, 2) * copies


TARGET = {"mode": "target", "error": 0.02}


@pytest.mark.parametrize("written", FILES.values(), ids=FILES)
def test_largest_texture_that_is_admitted_renders(
    client: httpx2.Client, written: Callable[[int], bytes]
) -> None:
    name = put(client, written(largest(client, "mipmap"))).json()["name"]
    finish(client, submit(client, filtered(name, "mipmap")))


@pytest.mark.parametrize("request_fields", [{}, {"quality": TARGET}], ids=["fixed", "target"])
def test_largest_texture_without_a_pyramid_renders_in_both_qualities(
    client: httpx2.Client, request_fields: dict[str, object]
) -> None:
    name = put(client, FILES["png"](largest(client, "bilinear"))).json()["name"]
    finish(client, submit(client, filtered(name, "bilinear"), **request_fields))


def test_mesh_of_triangles_in_one_place_renders(client: httpx2.Client) -> None:
    data = ply_of(200_000)
    put(client, data)
    finish(client, submit(client, with_mesh(data)))
