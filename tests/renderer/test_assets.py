"""Files that a scene names: where they may come from, and what may be in them."""

import io
import json
import os
import struct
import sys
import warnings
import zlib
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

import renderer
from accuracy.hard_cases.documents import phong, rectangle, scene
from renderer.assets import AssetError, FolderAssets
from renderer.images.reading import decode_image, image_size
from schemas.limits import Limits
from tests.pictures.parts import Files, png

TEXTURED = scene(
    rectangle([-1, -1, 0], [2, 0, 0], [0, 2, 0]),
    textures={"a/b": {"type": "image", "asset": "picture.png"}},
    materials={"plain": phong(color_texture="a/b")},
)


def bomb(width: int, height: int) -> bytes:
    """A PNG whose header states a size, and which has no pixels at all."""

    def chunk(kind: bytes, content: bytes) -> bytes:
        return (
            struct.pack(">I", len(content)) + kind + content + struct.pack(">I", zlib.crc32(kind + content))
        )

    header = struct.pack(">IIBBBBB", width, height, 8, 2, 0, 0, 0)
    return b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", header) + chunk(b"IDAT", b"") + chunk(b"IEND", b"")


def encoded(kind: str, mode: str = "RGB") -> bytes:
    values = np.random.default_rng(1).integers(0, 256, (9, 11, 3)).astype(np.uint8)
    buffer = io.BytesIO()
    Image.fromarray(values).convert(mode).save(buffer, format=kind)
    return buffer.getvalue()


@pytest.mark.parametrize("size", [(9000, 9000), (20000, 20000), (65535, 65535), (2**31 - 1, 2**31 - 1)])
def test_bomb_is_refused_by_its_header(size: tuple[int, int]) -> None:
    """Not by its pixels, of which it has none; the message names the limit."""
    for read in (image_size, decode_image):
        with pytest.raises(AssetError, match=r"The picture has .* Make it smaller\.") as caught:
            read(bomb(*size))
        assert str(Limits().max_image_pixels) in str(caught.value)


def test_limit_of_pixels() -> None:
    content = png(np.zeros((5, 4, 3), np.uint8))
    assert image_size(content, 20) == (4, 5)
    with pytest.raises(AssetError, match="4 x 5 pixels, more than the 19 allowed"):
        decode_image(content, 19)


def test_picture_without_pixels() -> None:
    with pytest.raises(AssetError, match="damaged"):
        decode_image(bomb(4, 4))


@pytest.mark.parametrize(
    "content", [b"", b"no picture", b"<svg/>", b"\x89PNG\r\n\x1a\n", b"%!PS-Adobe", b"GIF89a"]
)
def test_file_that_is_no_picture(content: bytes) -> None:
    with pytest.raises(AssetError, match=r"not a picture that can be read\. Use one of PNG, JPEG"):
        decode_image(content)


@pytest.mark.parametrize("kind", ["PNG", "JPEG", "WEBP", "TIFF", "BMP", "GIF", "PPM"])
def test_damaged_picture_is_refused_or_read(kind: str) -> None:
    """Cut off anywhere, and with any byte changed."""
    whole = encoded(kind)
    assert decode_image(whole).shape == (9, 11, 3)
    rng = np.random.default_rng(2)
    damaged = [whole[: int(n)] for n in rng.integers(0, len(whole), 60)]
    for _ in range(300):
        content = bytearray(whole)
        for place in rng.integers(0, min(len(whole), 300), rng.integers(1, 4)):
            content[place] = rng.integers(0, 256)
        damaged.append(bytes(content))
    outcomes = set()
    for content in damaged:
        try:
            found = decode_image(content, 1_000_000)
        except AssetError:
            outcomes.add("refused")
        else:
            outcomes.add("read")
            assert found.ndim == 3
            assert found.shape[2] == 3
            assert np.isfinite(found).all()
    assert "refused" in outcomes


@pytest.mark.parametrize("mode", ["RGB", "L", "P", "RGBA", "LA", "1", "CMYK"])
def test_kinds_of_pixels(mode: str) -> None:
    kind = "TIFF" if mode == "CMYK" else "PNG"
    found = decode_image(encoded(kind, mode))
    assert (found.shape, found.dtype) == ((9, 11, 3), np.float32)
    assert found.min() >= 0
    assert found.max() <= 1
    if mode in {"L", "LA", "1"}:
        assert (found == found[:, :, :1]).all()


def test_sixteen_bits_of_grey() -> None:
    values = np.array([[0, 1, 257, 65535]], dtype=np.uint16)
    buffer = io.BytesIO()
    Image.fromarray(values).save(buffer, format="PNG")
    assert (decode_image(buffer.getvalue())[0, :, 1] == values[0] / np.float32(65535)).all()


def test_alpha_is_dropped() -> None:
    buffer = io.BytesIO()
    Image.new("RGBA", (1, 1), (51, 102, 153, 0)).save(buffer, format="PNG")
    assert np.abs(decode_image(buffer.getvalue())[0, 0] * 255 - [51, 102, 153]).max() <= 1e-4


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    inside = tmp_path / "scenes"
    (inside / "below").mkdir(parents=True)
    (tmp_path / "secret.png").write_bytes(b"secret")
    (inside / "a.png").write_bytes(b"a")
    (inside / "below" / "b.png").write_bytes(b"b")
    (inside / "out.png").symlink_to(tmp_path / "secret.png")
    (inside / "away").symlink_to(tmp_path)
    (inside / "in.png").symlink_to(inside / "a.png")
    (inside / "loop.png").symlink_to(inside / "loop.png")
    os.mkfifo(inside / "pipe.png")
    return inside


@pytest.mark.parametrize(
    ("name", "content"),
    [("a.png", b"a"), ("below/b.png", b"b"), ("./below/../a.png", b"a"), ("in.png", b"a")],
)
def test_files_in_the_folder(folder: Path, name: str, content: bytes) -> None:
    assert FolderAssets(folder).read(name) == content


@pytest.mark.parametrize(
    "name",
    [
        "../secret.png",
        "below/../../secret.png",
        "out.png",
        "away/secret.png",
        "/etc/passwd",
        "~/secret.png",
        "nowhere.png",
        "below",
        ".",
        "",
        "loop.png",
        "pipe.png",
        "a.png/b.png",
        "x" * 1000,
        "a\0.png",
        "\ud800.png",
        "http://localhost/a.png",
    ],
)
def test_files_outside_the_folder(folder: Path, name: str) -> None:
    """Outside of the folder, a link that leads out of it, a folder, a pipe, an impossible name."""
    with pytest.raises(KeyError):
        FolderAssets(folder).read(name)


@pytest.mark.parametrize(
    ("name", "reason"),
    [
        ("../secret.png", "This path leads outside the scene's folder by '..'."),
        ("below/../../secret.png", "This path leads outside the scene's folder by '..'."),
        ("/etc/passwd", "This absolute path leads outside the scene's folder."),
        ("out.png", "A symbolic link on this path leads outside the scene's folder."),
        ("away/secret.png", "A symbolic link on this path leads outside the scene's folder."),
        ("below", "This is a folder."),
        ("http://localhost/a.png", "Nothing is fetched from an address."),
        ("below\\b.png", "There is no such file."),
        ("nowhere.png", "There is no such file. Name one in the scene's folder"),
        ("A.PNG", "There is no such file. Did you mean 'a.png'?"),
        ("Below/B.png", "There is no such file. Did you mean 'below/b.png'?"),
        ("C:\\scenes\\below\\b.png", "There is no such file. Did you mean 'below/b.png'?"),
        ("C:\\scenes\\A.png", "There is no such file. Did you mean 'a.png'?"),
        ("textures/a.png", "There is no such file. Did you mean 'a.png'?"),
        ("sha256:" + "0" * 64, "This names an uploaded file"),
    ],
)
def test_unreadable_file_is_a_problem(folder: Path, name: str, reason: str) -> None:
    scene = json.loads(json.dumps(TEXTURED).replace("picture.png", name.replace("\\", "\\\\")))
    with pytest.raises(renderer.SceneError) as caught:
        renderer.compile_scene(renderer.load_scene(scene, assets=FolderAssets(folder)))
    (problem,) = caught.value.errors
    assert problem.pointer == "/textures/a~1b/asset"
    assert problem.detail.startswith(reason)
    assert "\\" not in name or "separated by '/'" in problem.detail
    # Nothing is uploaded where files are read.
    assert "upload it" not in problem.detail.lower()


def test_folder_reached_by_a_link(folder: Path, tmp_path: Path) -> None:
    (tmp_path / "door").symlink_to(folder)
    assert FolderAssets(tmp_path / "door").read("a.png") == b"a"


@pytest.mark.parametrize(
    ("files", "detail"),
    [
        ({}, "no such file"),
        ({"picture.png": b"text"}, "not a picture"),
        ({"picture.png": bomb(20000, 20000)}, "Make it smaller"),
    ],
    ids=["missing", "no picture", "bomb"],
)
def test_unusable_file_is_located(files: dict[str, bytes], detail: str) -> None:
    with pytest.raises(renderer.SceneError) as caught:
        renderer.compile_scene(renderer.load_scene(TEXTURED, assets=Files(files)))
    (problem,) = caught.value.errors
    assert (problem.pointer, problem.code) == ("/textures/a~1b/asset", "asset")
    assert detail in problem.detail


def test_decoding_leaves_warning_filters() -> None:
    """They belong to the process; a filter that stays would hide what others want to see."""
    buffer = io.BytesIO()
    Image.fromarray(np.zeros((64, 64, 3), np.uint8)).save(buffer, format="PNG")
    before, interval = list(warnings.filters), sys.getswitchinterval()
    sys.setswitchinterval(1e-6)
    try:
        with ThreadPoolExecutor(8) as pool:
            list(pool.map(decode_image, [buffer.getvalue()] * 200))
        assert list(warnings.filters) == before
    finally:
        sys.setswitchinterval(interval)
        warnings.filters[:] = before
