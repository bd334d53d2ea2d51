"""Pictures written as PNG and NumPy files."""

import io
import math
import stat
import struct
import zlib
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from renderer.errors import ImageFileError, RenderError
from renderer.images.colors import linear_from_srgb
from renderer.images.files import encode_npy, encode_png, write_image
from renderer.images.reading import decode_image
from schemas.scene import Display

SRGB = Display()
GREY = np.repeat(np.array([[[0.1], [0.7]]], dtype=np.float32), 3, axis=2)


def test_npy_holds_the_linear_picture() -> None:
    image = np.random.default_rng(1).normal(size=(3, 4, 3)).astype(np.float32)
    read = np.load(io.BytesIO(encode_npy(image)), allow_pickle=False)
    assert (read.dtype, read.tobytes()) == (np.float32, image.tobytes())


@pytest.mark.parametrize("ending", ["png", "npy", "exr"])
def test_file_is_written_whole_and_replaces_the_old(ending: str, tmp_path: Path) -> None:
    """Its ending may be in capitals, and the same picture is the same file."""
    target, other = tmp_path / f"a.{ending}", tmp_path / f"b.{ending.upper()}"
    target.write_bytes(b"old")
    for path in (target, other):
        write_image(path, GREY, SRGB)
    assert len(target.read_bytes()) > 50
    assert target.read_bytes() == other.read_bytes()
    assert {*tmp_path.iterdir()} == {target, other}
    assert stat.S_IMODE(target.stat().st_mode) & 0o600 == 0o600


def codes_of(content: bytes) -> np.ndarray:
    """The numbers of a PNG of 16 bits and three colours, read by the book: Pillow keeps 8 of them."""
    place, packed = 8, b""
    while place < len(content):
        length, kind = struct.unpack(">I4s", content[place : place + 8])
        data = content[place + 8 : place + 8 + length]
        assert zlib.crc32(kind + data) == struct.unpack(">I", content[place + 8 + length :][:4])[0]
        if kind == b"IHDR":
            width, height, *rest = struct.unpack(">IIBBBBB", data)
            assert rest == [16, 2, 0, 0, 0]
        packed += data if kind == b"IDAT" else b""
        place += 12 + length
    lines = np.frombuffer(zlib.decompress(packed), np.uint8).reshape(height, 1 + 6 * width)
    assert set(lines[:, 0]) <= {0, 2}
    rows, above = [], np.zeros(6 * width, np.uint8)
    for line in lines:
        above = line[1:] + above if line[0] == 2 else line[1:]
        rows.append(above.tobytes())
    return np.frombuffer(b"".join(rows), ">u2").reshape(height, width, 3)


def code_of(x: float, transfer: str) -> int:
    encoded = x if transfer == "linear" else 12.92 * x if x <= 0.0031308 else 1.055 * x ** (1 / 2.4) - 0.055
    return math.floor(65535 * encoded + 0.5)


@pytest.mark.parametrize("transfer", ["srgb", "linear"])
def test_png_of_16_bits_holds_each_code(transfer: str, tmp_path: Path) -> None:
    image = np.random.default_rng(1).random((7, 5, 3), np.float32) ** 3
    image[0, 0], image[0, 1], image[6, 4] = [0, 1, np.nan], [-1, 2, np.inf], [1e-5, 0.0031308, 0.5]
    write_image(tmp_path / "a.png", image, Display(transfer=transfer, exposure=-1), bits=16)
    content = (tmp_path / "a.png").read_bytes()
    shown = np.clip(np.nan_to_num(image.astype(float) / 2, posinf=1), 0, 1)
    expected = [code_of(x, transfer) for x in shown.ravel().tolist()]
    assert codes_of(content).ravel().tolist() == expected
    assert np.abs(decode_image(content).ravel() * 65535 - expected).max() < 0.01


@pytest.mark.parametrize("bits", [8, 16])
def test_png_of_many_rows_has_the_codes_of_each(bits: int) -> None:
    """80,000 pixels are more than are encoded at once."""
    image = np.random.default_rng(2).random((200, 400, 3), dtype=np.float32)

    def codes(pixels: np.ndarray) -> np.ndarray:
        content = encode_png(pixels, SRGB, bits)
        return np.asarray(Image.open(io.BytesIO(content))) if bits == 8 else codes_of(content)

    np.testing.assert_array_equal(codes(image), np.concatenate([codes(row[None]) for row in image]))


@pytest.mark.parametrize("mode", ["RGB", "P"])
def test_texture_of_many_rows_has_the_colours_of_each(mode: str) -> None:
    """1.2 million pixels are more than are converted at once, to floats and to light."""
    codes = np.random.default_rng(3).integers(0, 256, (1500, 800, 3), dtype=np.uint8)
    picture = Image.fromarray(codes[..., 0] if mode in {"L", "P"} else codes).convert(mode)
    file = io.BytesIO()
    picture.save(file, "PNG", compress_level=1)
    values = decode_image(file.getvalue())
    np.testing.assert_array_equal(values, np.asarray(picture.convert("RGB"), np.float32) / np.float32(255))
    rows = [linear_from_srgb(row) for row in values]
    np.testing.assert_array_equal(linear_from_srgb(values), np.stack(rows))


@pytest.mark.parametrize(
    ("name", "options", "said"),
    [
        ("a.exr", {"bits": 16}, "'bits'"),
        ("a.npy", {"bits": 16}, "'bits'"),
        ("a.png", {"bits": 12}, "'bits'"),
        ("a.jpg", {}, r"\.png or \.npy"),
        ("a", {}, r"\.png or \.npy"),
        ("a.png.gz", {}, r"\.png or \.npy"),
        ("nowhere/a.png", {}, "nowhere"),
        ("taken.png", {}, "taken"),
    ],
)
def test_file_that_cannot_be_written_leaves_nothing(
    name: str, options: dict[str, int], said: str, tmp_path: Path
) -> None:
    (tmp_path / "taken.png").mkdir()
    with pytest.raises(ImageFileError, match=said) as caught:
        write_image(tmp_path / name, GREY, SRGB, **options)
    assert isinstance(caught.value, RenderError)
    assert [path.name for path in tmp_path.iterdir()] == ["taken.png"]
