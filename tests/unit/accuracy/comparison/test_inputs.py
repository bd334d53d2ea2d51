"""Pictures from files: numbers as they are meant, and a clear word where they cannot be used."""

import io
import struct
import zlib
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from PIL import Image

from accuracy.comparison import NotComparableError, picture_of, read_picture
from renderer.images.files import encode_exr


def png(codes: np.ndarray, mode: str | None = None) -> bytes:
    buffer = io.BytesIO()
    picture = Image.fromarray(codes)
    (picture.convert(mode) if mode else picture).save(buffer, format="PNG")
    return buffer.getvalue()


def npy(values: np.ndarray) -> bytes:
    buffer = io.BytesIO()
    np.save(buffer, values)
    return buffer.getvalue()


def deep_png() -> bytes:
    """One pixel with 16 bits a channel, chunk by chunk: Pillow cannot write such a file."""
    chunks = [(b"IHDR", struct.pack(">IIBBBBB", 1, 1, 16, 2, 0, 0, 0)), (b"IDAT", zlib.compress(bytes(7)))]
    parts = [
        struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))
        for kind, data in [*chunks, (b"IEND", b"")]
    ]
    return b"\x89PNG\r\n\x1a\n" + b"".join(parts)


CODES = np.arange(24, dtype=np.uint8).reshape(2, 4, 3) * 10


def literal_linear(code: int) -> float:
    x = code / 255
    return x / 12.92 if x <= 0.04045 else ((x + 0.055) / 1.055) ** 2.4


def test_png_is_srgb_unless_given_otherwise_and_the_picture_records_it() -> None:
    usual, stated = picture_of(png(CODES), "a.png"), picture_of(png(CODES), "a.png", "linear")
    assert (usual.encoding, usual.stated) == ("srgb", False)
    assert (stated.encoding, stated.stated) == ("linear", True)
    # The decoder answers in float32.
    expected = [literal_linear(int(code)) for code in CODES.flat]
    assert usual.linear.ravel().tolist() == pytest.approx(expected, rel=2.0**-22)
    assert stated.linear.ravel().tolist() == [code / 255 for code in CODES.ravel().tolist()]


def test_floating_point_is_linear_and_is_clipped_to_what_a_display_shows() -> None:
    values = np.full((2, 2, 3), 0.5, np.float32)
    values[0, 0, 0], values[1, 1, 2] = 3.0, -1.0
    picture = picture_of(npy(values), "a.npy")
    assert picture.encoding == "linear"
    assert picture.clipped == 2
    assert picture.linear[0, 0].tolist() == [1.0, 0.5, 0.5]
    assert picture.linear[1, 1].tolist() == [0.5, 0.5, 0.0]


def test_exr_comes_with_the_layers_of_noise_and_shapes() -> None:
    layers = {
        "error": np.full((2, 3, 3), 0.25, np.float32),
        "samples": np.full((2, 3), 4, np.int32),
        "shape": np.array([[0, 1, -1]] * 2, np.int32),
        "depth": np.ones((2, 3), np.float32),
    }
    image = np.linspace(0, 1, 18, dtype=np.float32).reshape(2, 3, 3)
    picture = picture_of(encode_exr(image, layers), "a.exr")
    assert picture.linear.tolist() == image.tolist()
    assert set(picture.layers) == {"error", "samples", "shape"}
    assert picture.layers["shape"].tolist() == layers["shape"].tolist()


def test_layers_that_lie_beside_a_file_belong_to_it(tmp_path: Path) -> None:
    (tmp_path / "a.npy").write_bytes(npy(np.zeros((2, 3, 3), np.float32)))
    (tmp_path / "a.npy.samples.npy").write_bytes(npy(np.full((2, 3), 9, np.int32)))
    assert read_picture(tmp_path / "a.npy").layers["samples"].tolist() == [[9, 9, 9]] * 2


def test_grey_counts_in_all_channels_and_alpha_that_hides_nothing_is_left_out() -> None:
    grey = picture_of(png(np.array([[0, 255]], np.uint8)), "grey.png")
    assert grey.linear.tolist() == [[[0, 0, 0], [1, 1, 1]]]
    assert "grey" in grey.notes[0]
    opaque = picture_of(png(CODES, "RGBA"), "opaque.png")
    assert opaque.linear.tolist() == picture_of(png(CODES), "a.png").linear.tolist()
    assert "alpha" in opaque.notes[0]
    palette = picture_of(png(CODES, "P"), "palette.png")
    assert palette.linear.shape == (2, 4, 3)


def clear() -> np.ndarray:
    codes = np.full((2, 2, 4), 255, np.uint8)
    codes[1, 0, 3] = 254
    return codes


def with_nan() -> np.ndarray:
    values = np.zeros((4, 5, 3), np.float32)
    values[2, 3, 1] = np.nan
    return values


@pytest.mark.parametrize(
    ("content", "word"),
    [
        (b"", "not a PNG, NPY or EXR"),
        (b"GIF89a", "not a PNG, NPY or EXR"),
        (png(CODES)[:50], "damaged"),
        (png(CODES)[:8], "damaged"),
        (npy(np.zeros((3, 3, 3)))[:-5], "damaged"),
        (npy(np.zeros((3, 3, 3))).replace(b"'<f8'", b"{(<f8"), "damaged"),
        (npy(np.zeros((3, 3, 3))).replace(b"(3, 3, 3)", b"(9999999,3,999999)"), "damaged"),
        (deep_png(), "16 bits"),
        (png(np.array([[1, 70000 % 65536]], np.uint16)), "16 bits"),
        (png(clear()), "transparent"),
        (npy(with_nan()), "column 3, row 2"),
        (npy(np.full((2, 2, 3), np.inf)), "infinite"),
        (npy(np.zeros((2, 2, 5), np.float32)), "shape"),
        (npy(np.zeros((0, 2, 3), np.float32)), "no pixels"),
        (npy(np.zeros((2, 2, 3), np.complex64)), "complex64"),
        (npy(np.zeros((2, 2, 3), np.uint8)), "State the encoding"),
        (npy(np.zeros(7, np.float32)), "shape"),
    ],
)
def test_what_is_no_picture_is_refused_with_the_reason(content: bytes, word: str) -> None:
    with pytest.raises(NotComparableError, match=word):
        picture_of(content, "picture")


def test_whole_numbers_in_an_array_are_read_as_stated() -> None:
    picture = picture_of(npy(np.full((1, 1, 3), 65535, np.uint16)), "a.npy", "linear")
    assert picture.linear.tolist() == [[[1.0, 1.0, 1.0]]]
    assert picture.bits == 16


def test_layers_of_another_size_are_refused(tmp_path: Path) -> None:
    layers: dict[str, Any] = {"samples": np.ones((3, 3))}
    with pytest.raises(NotComparableError, match="'samples'"):
        picture_of(npy(np.zeros((2, 2, 3))), "a.npy", layers=layers)


def test_a_file_that_is_not_there_is_named(tmp_path: Path) -> None:
    with pytest.raises(NotComparableError, match=r"none\.png"):
        read_picture(tmp_path / "none.png")


def test_rounding_is_half_a_code_or_two_spacings_of_float32() -> None:
    eight = picture_of(png(np.array([[0, 255]], np.uint8)), "a.png", "linear")
    assert eight.rounding[0, 0, 0] == 0.5 / 255
    floating = picture_of(npy(np.full((1, 1, 3), 0.5, np.float32)), "a.npy")
    assert floating.rounding[0, 0, 0] == 2 * np.spacing(np.float32(0.5))
