"""Texture files of every format: read to the last digit, or refused by name."""

import io
import struct
import sys
import warnings
from concurrent.futures import ThreadPoolExecutor
from fractions import Fraction
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray
from PIL import Image

from renderer.assets import AssetError
from renderer.images.reading import decode_image, image_size, read_image
from tests.renderer.picture_files import by_channels, chunk, deep_png, exr, hdr, pfm, ppm, tiff

RANDOM = np.random.default_rng(34)
COLORS = RANDOM.integers(0, 1 << 16, (5, 11, 3)).astype(np.uint16)
CLEAR = np.concatenate((COLORS, RANDOM.integers(0, 1 << 16, (5, 11, 1)).astype(np.uint16)), axis=2)
GREY = COLORS[..., 0]
LIGHT = RANDOM.normal(size=(5, 11, 3)).astype(np.float32)
RGB_LIGHT = exr({"R": LIGHT[..., 0], "G": LIGHT[..., 1], "B": LIGHT[..., 2]})


def three(grey: NDArray[Any]) -> NDArray[Any]:
    return np.stack([grey] * 3, axis=2)


def assert_codes(content: bytes, codes: NDArray[Any], largest: int = 65535) -> None:
    """Each value is a code over the largest, rounded to float32 twice at most."""
    values = decode_image(content)
    assert values.dtype == np.float32
    assert values.shape == codes.shape
    exact = codes.astype(np.float64) / largest
    assert (np.abs(values - exact) <= 2 * np.spacing(exact.astype(np.float32))).all()
    assert image_size(content) == codes.shape[1::-1]


@pytest.mark.parametrize("interlaced", [False, True])
@pytest.mark.parametrize(
    ("codes", "kind", "colors"),
    [
        (GREY[..., None], 0, three(GREY)),
        (COLORS, 2, COLORS),
        (CLEAR[..., 2:], 4, three(CLEAR[..., 2])),
        (CLEAR, 6, COLORS),
    ],
    ids=["grey", "colours", "grey and alpha", "colours and alpha"],
)
def test_png_of_16_bits(codes: NDArray[Any], kind: int, colors: NDArray[Any], interlaced: bool) -> None:
    """Chunks that name a gamma or significant bits change nothing, nor does broken Exif."""
    chunks = {"gAMA": struct.pack(">I", 100000), "sBIT": bytes([12] * codes.shape[2]), "eXIf": b"II*\0none"}
    assert_codes(deep_png(codes, kind, interlaced=interlaced, **chunks), colors)


@pytest.mark.parametrize("order", ["<", ">"])
@pytest.mark.parametrize("packed", [0, 1])
@pytest.mark.parametrize(
    ("pixels", "options", "colors"),
    [
        (GREY, {"photometric": 1}, three(GREY)),
        (COLORS, {"photometric": 2}, COLORS),
        (CLEAR, {"photometric": 2, "extra": 2}, COLORS),
        (CLEAR, {"photometric": 2, "extra": 0}, COLORS),
        (COLORS, {"photometric": 2, "orientation": 6}, np.rot90(COLORS, -1)),
    ],
    ids=["grey", "colours", "colours and alpha", "colours and padding", "turned"],
)
def test_tiff_of_16_bits(
    pixels: NDArray[Any], options: dict[str, int], colors: NDArray[Any], order: str, packed: int
) -> None:
    assert_codes(tiff(pixels, order, packed=packed, **options), colors)


def test_tiff_of_12_and_of_32_bits() -> None:
    whole = RANDOM.integers(0, 1 << 32, (5, 11)).astype(np.uint32)
    for packed in (0, 1):
        assert_codes(tiff(whole, "<", 1, packed=packed), three(whole), (1 << 32) - 1)
    # Two numbers of 12 bits in three bytes: 0xABC and 0xDEF.
    content = bytearray(tiff(np.array([[0xAB, 0xCD, 0xEF]], np.uint8), "<", 1))
    for tag, code, old, new in ((256, 4, 3, 2), (258, 3, 8, 12)):
        place = content.index(struct.pack("<HHII", tag, code, 1, old))
        content[place : place + 12] = struct.pack("<HHII", tag, code, 1, new)
    assert_codes(bytes(content), three(np.array([[0xABC, 0xDEF]])), 4095)


@pytest.mark.parametrize("kind", ["6", "3"])
@pytest.mark.parametrize("largest", [65535, 1023, 256])
def test_ppm_of_more_than_8_bits(kind: str, largest: int) -> None:
    codes = np.minimum(COLORS, largest)
    assert_codes(ppm(kind, codes, largest), codes, largest)


@pytest.mark.parametrize(
    ("content", "values"),
    [
        *((pfm(values, order), values) for values in (LIGHT, LIGHT[..., 0]) for order in "<>"),
        *((tiff(LIGHT[..., 0], order, 1, packed=n), LIGHT[..., 0]) for order in "<>" for n in (0, 1)),
        (exr({"Y": LIGHT[..., 0]}), LIGHT[..., 0]),
        (RGB_LIGHT, LIGHT),
    ],
    ids=["pfm <", "pfm >", "grey pfm <", "grey pfm >", *(f"tiff {n}" for n in range(4)), "grey exr", "exr"],
)
def test_float_pictures_keep_their_values(content: bytes, values: NDArray[np.float32]) -> None:
    """Numbers below 0 and above 1 stay what they are."""
    found = read_image(content)
    assert found.floating
    assert np.array_equal(found.values, values if values.ndim == 3 else three(values))
    assert image_size(content) == (11, 5)


def light_of(codes: NDArray[np.uint8]) -> list[float]:
    """RGBE by exact arithmetic: a mantissa over 256, times 2 to the exponent less 128."""
    return [
        float(Fraction(int(m), 256) * Fraction(2) ** (int(pixel[3]) - 128)) if pixel[3] else 0.0
        for pixel in codes.reshape(-1, 4)
        for m in pixel[:3]
    ]


def test_radiance_picture_with_every_kind_of_line() -> None:
    codes = RANDOM.integers(2, 255, (4, 300, 4)).astype(np.uint8)
    codes[..., 3] = RANDOM.integers(100, 150, (4, 300))
    codes[:, 20:290] = codes[:, 20:21]
    codes[3, :, 3] = 0
    # 269 repetitions are the digits 13 and 1 to the base 256.
    old = codes[2, :21].tobytes() + b"\1\1\1\x0d" + b"\1\1\1\1" + codes[2, 290:].tobytes()
    body = by_channels(codes[0]) + codes[1].tobytes() + old + by_channels(codes[3])
    found = read_image(hdr(body, "-Y 4 +X 300"))
    assert found.floating
    assert found.values.ravel().tolist() == light_of(codes)


@pytest.mark.parametrize(
    ("size", "turn"),
    [
        ("-Y 2 +X 3", lambda a: a),
        ("+Y 2 +X 3", lambda a: a[::-1]),
        ("-Y 2 -X 3", lambda a: a[:, ::-1]),
        ("+X 2 -Y 3", lambda a: a.swapaxes(0, 1)),
        ("-X 2 +Y 3", lambda a: np.rot90(a.swapaxes(0, 1), 2)),
    ],
)
def test_radiance_picture_may_begin_at_any_corner(size: str, turn: Any) -> None:
    codes = RANDOM.integers(2, 140, (2, 3, 4)).astype(np.uint8)
    upright = turn(np.array(light_of(codes), np.float32).reshape(2, 3, 3))
    assert np.array_equal(decode_image(hdr(codes.tobytes(), size)), upright)
    assert image_size(hdr(codes.tobytes(), size)) == upright.shape[1::-1]


@pytest.mark.parametrize(
    ("content", "said"),
    [
        (tiff(GREY.astype(np.int16), "<", 1), "sign"),
        (tiff(GREY, "<", 0), "0 is white"),
        (tiff(CLEAR, "<", 5), "CMYK"),
        (tiff(CLEAR, "<", 2, extra=1), "RGBA"),
        (tiff(COLORS, ">", 2, planes=2), "RGB"),
        (tiff(LIGHT, "<", 2), "floating-point"),
        (tiff(COLORS.astype(np.uint8), "<", 8), "LAB"),
        (pfm(LIGHT, "<").replace(b"-1.0", b"-2.5"), "-2.5"),
        (pfm(np.where(LIGHT[1, 2] == LIGHT, np.nan, LIGHT), "<"), "column 2, row 1"),
        (hdr(bytes(16), "-Y 2 +X 2", "32-bit_rle_xyze"), "XYZ"),
        (exr(dict.fromkeys("RGB", GREY.astype(np.uint32))), "whole"),
        (exr({"Z": LIGHT[..., 0]}), "Z"),
        (b"", "PNG, JPEG"),
        (b"no picture", "PNG, JPEG"),
        (b"<svg/>", "PNG, JPEG"),
        (b"GIF89a", "PNG, JPEG"),
        (b"\x93NUMPY\x01", r"\.npy"),
        (b"%PDF-1.7", "PDF"),
    ],
    ids=lambda value: value if isinstance(value, str) else "file",
)
def test_picture_that_cannot_be_read_right_is_refused(content: bytes, said: str) -> None:
    with pytest.raises(AssetError, match=said):
        read_image(content)


def encoded(kind: str, mode: str = "RGB") -> bytes:
    values = np.random.default_rng(1).integers(0, 256, (9, 11, 3)).astype(np.uint8)
    buffer = io.BytesIO()
    Image.fromarray(values).convert(mode).save(buffer, format=kind)
    return buffer.getvalue()


WHOLE = {
    "hdr": hdr(by_channels(CLEAR[0].astype(np.uint8)) * 5, "-Y 5 +X 11"),
    "hdr by pixels": hdr(CLEAR.astype(np.uint8).tobytes(), "-Y 5 +X 11"),
    "pfm": pfm(LIGHT, "<"),
    "ppm": ppm("6", COLORS, 65535),
    "plain ppm": ppm("3", COLORS, 1000),
    "png of 16 bits": deep_png(CLEAR, 6),
    "tiff of 16 bits": tiff(COLORS, "<", 2, packed=1),
    "exr": RGB_LIGHT,
    **{kind: encoded(kind) for kind in ("PNG", "JPEG", "WEBP", "TIFF", "BMP", "GIF", "PPM")},
}


@pytest.mark.parametrize("kind", WHOLE)
def test_damaged_picture_is_refused_or_read(kind: str) -> None:
    """Cut off anywhere, and with any byte changed."""
    whole, rng = WHOLE[kind], np.random.default_rng(2)
    damaged = [whole[: int(n)] for n in rng.integers(0, len(whole), 60)]
    for _ in range(200):
        content = bytearray(whole)
        for place in rng.integers(0, len(whole), rng.integers(1, 4)):
            content[place] = rng.integers(0, 256)
        damaged.append(bytes(content))
    refused = 0
    for content in damaged:
        try:
            found = decode_image(content, 1_000_000)
        except AssetError:
            refused += 1
        else:
            assert found.shape[2] == 3
            assert np.isfinite(found).all()
    assert refused


@pytest.mark.parametrize("mode", ["RGB", "L", "P", "RGBA", "LA", "1", "CMYK"])
def test_pixel_modes_become_rgb(mode: str) -> None:
    found = decode_image(encoded("TIFF" if mode == "CMYK" else "PNG", mode))
    assert (found.shape, found.dtype) == ((9, 11, 3), np.float32)
    assert 0 <= found.min() < found.max() <= 1
    assert mode not in {"L", "LA", "1"} or (found == found[:, :, :1]).all()


@pytest.mark.parametrize("size", [(9000, 9000), (65535, 65535), (2**31 - 1, 2**31 - 1)])
def test_bomb_is_refused_by_its_header(size: tuple[int, int]) -> None:
    """It has no pixels at all; with a size that is allowed it is damaged."""

    def png_of(width: int, height: int) -> bytes:
        header = struct.pack(">IIBBBBB", width, height, 8, 2, 0, 0, 0)
        parts = ((b"IHDR", header), (b"IDAT", b""), (b"IEND", b""))
        return b"\x89PNG\r\n\x1a\n" + b"".join(chunk(*part) for part in parts)

    for read in (image_size, decode_image):
        with pytest.raises(AssetError, match="smaller"):
            read(png_of(*size))
    with pytest.raises(AssetError, match="damaged"):
        decode_image(png_of(4, 4))


@pytest.mark.parametrize("kind", ["pfm", "hdr", "exr", "ppm", "png of 16 bits"])
def test_pixel_limit_holds_for_every_format(kind: str) -> None:
    assert image_size(WHOLE[kind], 55) == (11, 5)
    for read in (image_size, decode_image):
        with pytest.raises(AssetError, match="11 x 5 pixels, more than the 54 allowed"):
            read(WHOLE[kind], 54)


UPRIGHT = np.array([[[10, 0, 0], [20, 0, 0], [30, 0, 0]], [[40, 0, 0], [50, 0, 0], [60, 0, 0]]], np.uint8)
STORED = {
    # By CIPA DC-008: the sides of the upright picture where row 0 and column 0 are stored.
    1: UPRIGHT,
    2: UPRIGHT[:, ::-1],
    3: UPRIGHT[::-1, ::-1],
    4: UPRIGHT[::-1],
    5: UPRIGHT.swapaxes(0, 1),
    6: UPRIGHT.swapaxes(0, 1)[::-1],
    7: UPRIGHT.swapaxes(0, 1)[::-1, ::-1],
    8: UPRIGHT.swapaxes(0, 1)[:, ::-1],
    9: UPRIGHT,
}


@pytest.mark.parametrize("orientation", STORED)
def test_exif_orientation_turns_the_picture(orientation: int) -> None:
    stored = Image.fromarray(np.ascontiguousarray(STORED[orientation]))
    exif = Image.Exif()
    exif[274] = orientation
    deep = STORED[orientation].astype(np.uint16) * 257
    contents = [deep_png(deep, 2, eXIf=exif.tobytes().removeprefix(b"Exif\0\0"))]
    for form, options in (("PNG", {}), ("WEBP", {"lossless": True, "exact": True}), ("TIFF", {})):
        buffer = io.BytesIO()
        stored.save(buffer, form, exif=exif.tobytes(), **options)
        contents.append(buffer.getvalue())
    for content in contents:
        assert np.rint(255 * decode_image(content)).tolist() == UPRIGHT.tolist()
        assert image_size(content) == (3, 2)


def test_alpha_is_dropped() -> None:
    """The colours behind it stay."""
    buffer = io.BytesIO()
    Image.new("RGBA", (1, 1), (51, 102, 153, 0)).save(buffer, format="PNG")
    assert np.abs(decode_image(buffer.getvalue())[0, 0] * 255 - [51, 102, 153]).max() <= 1e-4


def test_decoding_leaves_warning_filters_alone() -> None:
    """Threads share them with the whole process."""
    content, before, interval = encoded("PNG"), list(warnings.filters), sys.getswitchinterval()
    sys.setswitchinterval(1e-6)
    try:
        with ThreadPoolExecutor(8) as pool:
            list(pool.map(decode_image, [content] * 200))
        assert list(warnings.filters) == before
    finally:
        sys.setswitchinterval(interval)
        warnings.filters[:] = before
