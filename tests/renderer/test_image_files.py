"""Pictures as files."""

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


def gray(values: object) -> np.ndarray:
    return np.repeat(np.asarray(values, dtype=np.float32).reshape(1, -1, 1), 3, axis=2)


def read_back(content: bytes) -> np.ndarray:
    with Image.open(io.BytesIO(content)) as picture:
        assert (picture.format, picture.mode) == ("PNG", "RGB")
        return np.asarray(picture)


def test_npy_file() -> None:
    image = np.random.default_rng(1).normal(size=(3, 4, 3)).astype(np.float32)
    read = np.load(io.BytesIO(encode_npy(image)), allow_pickle=False)
    assert (read.dtype, read.tobytes()) == (np.float32, image.tobytes())


@pytest.mark.parametrize("name", ["a.png", "a.npy"])
def test_file_replaces_the_old_one(name: str, tmp_path: Path) -> None:
    target = tmp_path / name
    target.write_bytes(b"old")
    write_image(target, gray([0, 0.5, 1]), SRGB)
    content = target.read_bytes()
    assert content == (encode_png if name.endswith("png") else lambda image, _: encode_npy(image))(
        gray([0, 0.5, 1]), SRGB
    )
    assert list(tmp_path.iterdir()) == [target]
    assert stat.S_IMODE(target.stat().st_mode) & 0o600 == 0o600


def test_same_picture_same_file(tmp_path: Path) -> None:
    for name in ("a.png", "b.png"):
        write_image(tmp_path / name, gray([0.1, 0.7]), SRGB)
    assert (tmp_path / "a.png").read_bytes() == (tmp_path / "b.png").read_bytes()


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
def test_png_of_16_bits(transfer: str, tmp_path: Path) -> None:
    image = np.random.default_rng(1).random((7, 5, 3), np.float32) ** 3
    image[0, 0], image[0, 1], image[6, 4] = [0, 1, np.nan], [-1, 2, np.inf], [1e-5, 0.0031308, 0.5]
    write_image(tmp_path / "a.png", image, Display(transfer=transfer, exposure=-1), bits=16)
    content = (tmp_path / "a.png").read_bytes()
    shown = np.clip(np.nan_to_num(image.astype(float) / 2, posinf=1), 0, 1)
    expected = [code_of(x, transfer) for x in shown.ravel().tolist()]
    assert codes_of(content).ravel().tolist() == expected
    assert np.abs(decode_image(content).ravel() * 65535 - expected).max() < 0.01


@pytest.mark.parametrize(("name", "bits"), [("a.exr", 16), ("a.npy", 16), ("a.png", 12), ("a.png", 1)])
def test_invalid_bits(name: str, bits: int, tmp_path: Path) -> None:
    with pytest.raises(ImageFileError, match="'bits' is 8 or 16"):
        write_image(tmp_path / name, gray([0]), SRGB, bits=bits)
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize("bits", [8, 16])
def test_large_picture_in_bands(bits: int) -> None:
    """80,000 pixels are more than are encoded at once."""
    codes = read_back if bits == 8 else codes_of
    image = np.random.default_rng(2).random((200, 400, 3), dtype=np.float32)
    rows = [codes(encode_png(row[None], SRGB, bits)) for row in image]
    np.testing.assert_array_equal(codes(encode_png(image, SRGB, bits)), np.concatenate(rows))


@pytest.mark.parametrize("mode", ["RGB", "L", "P", "RGBA"])
def test_large_texture_in_bands(mode: str) -> None:
    """1.2 million pixels are more than are converted at once, to floats and to light."""
    codes = np.random.default_rng(3).integers(0, 256, (1500, 800, 3), dtype=np.uint8)
    picture = Image.fromarray(codes[..., 0] if mode in {"L", "P"} else codes).convert(mode)
    expected = np.asarray(picture.convert("RGB"), dtype=np.float32) / np.float32(255)
    file = io.BytesIO()
    picture.save(file, "PNG", compress_level=1)
    values = decode_image(file.getvalue())
    np.testing.assert_array_equal(values, expected)
    light = linear_from_srgb(values)
    np.testing.assert_array_equal(light, np.stack([linear_from_srgb(row) for row in values]))


@pytest.mark.parametrize("name", ["a.jpg", "a", ".png", "a.png.gz"])
def test_unknown_ending(name: str, tmp_path: Path) -> None:
    with pytest.raises(ImageFileError, match=r"must end in \.png or \.npy") as caught:
        write_image(tmp_path / name, gray([0]), SRGB)
    assert isinstance(caught.value, RenderError)
    assert list(tmp_path.iterdir()) == []


def test_failed_write_leaves_nothing(tmp_path: Path) -> None:
    """A folder has the name already."""
    (tmp_path / "a.png").mkdir()
    with pytest.raises(ImageFileError, match="cannot be written"):
        write_image(tmp_path / "a.png", gray([0]), SRGB)
    assert [path.name for path in tmp_path.iterdir()] == ["a.png"]
