"""Pictures deeper than 8 bits, and those of light: every digit is read, or the file refused by name."""

import io
import json
import struct
from fractions import Fraction
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray
from PIL import Image

import renderer
from accuracy.hard_cases.documents import phong, rectangle, scene
from renderer.assets import AssetError
from renderer.images.reading import decode_image, image_size, read_image
from tests.pictures.parts import image_of, plan_of
from tests.renderer.picture_files import by_channels, deep_png, exr, exr_of_parts, hdr, pfm, ppm, tiff

RANDOM = np.random.default_rng(34)
COLORS = RANDOM.integers(0, 1 << 16, (5, 11, 3)).astype(np.uint16)
CLEAR = np.concatenate((COLORS, RANDOM.integers(0, 1 << 16, (5, 11, 1)).astype(np.uint16)), axis=2)
GREY = COLORS[..., 0]
LIGHT = RANDOM.normal(size=(5, 11, 3)).astype(np.float32)


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
    """Chunks that name a gamma or significant bits change nothing."""
    bits = bytes([12] * codes.shape[2])
    content = deep_png(codes, kind, interlaced=interlaced, gAMA=struct.pack(">I", 100000), sBIT=bits)
    assert_codes(content, colors)


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


@pytest.mark.parametrize("order", ["<", ">"])
@pytest.mark.parametrize("values", [LIGHT, LIGHT[..., 0]], ids=["colours", "grey"])
def test_floating_point_pictures(values: NDArray[np.float32], order: str) -> None:
    """Numbers below 0 and above 1 stay what they are."""
    expected = values if values.ndim == 3 else three(values)
    contents = [pfm(values, order)]
    if values.ndim == 2:
        contents += [tiff(values, order, 1, packed=packed) for packed in (0, 1)]
        contents += [exr({"Y": values})]
    else:
        contents += [exr({"R": values[..., 0], "G": values[..., 1], "B": values[..., 2]})]
    for content in contents:
        found = read_image(content)
        assert found.floating
        assert np.array_equal(found.values, expected)
        assert image_size(content) == (11, 5)


@pytest.mark.parametrize(
    ("content", "said"),
    [
        (tiff(GREY.astype(np.int16), "<", 1), "whole numbers with a sign"),
        (tiff(GREY.astype(np.int32), ">", 1), "whole numbers with a sign"),
        (tiff(GREY, "<", 0), "16 bits in which 0 is white"),
        (tiff(CLEAR, "<", 5), "CMYK with 16 bits"),
        (tiff(CLEAR, "<", 2, extra=1), "RGBA with 16 bits"),
        (tiff(COLORS, ">", 2, planes=2), "RGB with 16 bits"),
        (tiff(LIGHT, "<", 2), "TIFF picture cannot be read: .* floating-point colours"),
        (tiff(COLORS.astype(np.uint8), "<", 8), "LAB colours"),
        (pfm(LIGHT, "<").replace(b"-1.0", b"-2.5"), "PFM picture has the scale -2.5"),
        (
            pfm(np.where(LIGHT[1, 2] == LIGHT, np.nan, LIGHT), "<"),
            "column 2, row 1 is NaN or infinite .1 such",
        ),
        (hdr(bytes(16), "-Y 2 +X 2", "32-bit_rle_xyze"), "CIE XYZ"),
        (
            exr({"R": GREY.astype(np.uint32), "G": GREY.astype(np.uint32), "B": GREY.astype(np.uint32)}),
            "whole",
        ),
        (exr({"Z": LIGHT[..., 0]}), "no picture; its channels are Z"),
    ],
)
def test_unread_formats_are_refused_by_name(content: bytes, said: str) -> None:
    with pytest.raises(AssetError, match=said):
        read_image(content)


def light_of(codes: NDArray[np.uint8]) -> list[float]:
    """RGBE by exact arithmetic: a mantissa over 256, times 2 to the exponent less 128."""
    return [
        float(Fraction(int(m), 256) * Fraction(2) ** (int(pixel[3]) - 128)) if pixel[3] else 0.0
        for pixel in codes.reshape(-1, 4)
        for m in pixel[:3]
    ]


def test_radiance_lines() -> None:
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
def test_radiance_corners(size: str, turn: Any) -> None:
    codes = RANDOM.integers(2, 140, (2, 3, 4)).astype(np.uint8)
    content = hdr(codes.tobytes(), size)
    upright = turn(np.array(light_of(codes), np.float32).reshape(2, 3, 3))
    assert np.array_equal(decode_image(content), upright)
    assert image_size(content) == upright.shape[1::-1]


@pytest.mark.parametrize(
    "whole",
    [
        hdr(by_channels(CLEAR[0].astype(np.uint8)) * 5, "-Y 5 +X 11"),
        hdr(CLEAR.astype(np.uint8).tobytes(), "-Y 5 +X 11"),
        pfm(LIGHT, "<"),
        ppm("6", COLORS, 65535),
        ppm("3", COLORS, 1000),
        deep_png(CLEAR, 6),
        tiff(COLORS, "<", 2, packed=1),
        exr({"R": LIGHT[..., 0], "G": LIGHT[..., 1], "B": LIGHT[..., 2]}),
    ],
    ids=["hdr", "hdr by pixels", "pfm", "ppm", "plain ppm", "png", "tiff", "exr"],
)
def test_damaged_deep_picture_is_refused_or_read(whole: bytes) -> None:
    rng = np.random.default_rng(2)
    damaged = [whole[: int(n)] for n in rng.integers(0, len(whole), 60)]
    for _ in range(200):
        content = bytearray(whole)
        for place in rng.integers(0, len(whole), rng.integers(1, 4)):
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
            assert found.shape[2] == 3
            assert np.isfinite(found).all()
    assert "refused" in outcomes


def exif(orientation: int) -> bytes:
    made = Image.Exif()
    made[274] = orientation
    return made.tobytes()


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
"""Row 0 is the visual left side and column 0 the bottom in 8; right side and top in 6; and so on."""


@pytest.mark.parametrize("orientation", STORED)
def test_exif_orientation(orientation: int) -> None:
    stored = Image.fromarray(np.ascontiguousarray(STORED[orientation]))
    contents = []
    for form, options in (("PNG", {}), ("WEBP", {"lossless": True, "exact": True}), ("TIFF", {})):
        buffer = io.BytesIO()
        stored.save(buffer, form, exif=exif(orientation), **options)
        contents.append(buffer.getvalue())
    deep = STORED[orientation].astype(np.uint16) * 257
    contents.append(deep_png(deep, 2, eXIf=exif(orientation).removeprefix(b"Exif\0\0")))
    for content in contents:
        assert np.rint(255 * decode_image(content)).tolist() == UPRIGHT.tolist()
        assert image_size(content) == (3, 2)


def shown(**texture: Any) -> dict[str, Any]:
    return scene(
        rectangle([-3, -3, 0], [6, 0, 0], [0, 6, 0]),
        textures={"a": {"type": "image", "asset": "picture", **texture}},
        materials={"plain": phong(color_texture="a", ambient=1.0, diffuse=0.0)},
        ambient=[1, 1, 1],
    )


def test_texture_brighter_than_white() -> None:
    bright = np.full((2, 2, 3), 7.5, np.float32)
    document = shown(encoding="linear")
    for content in (pfm(bright, "<"), exr(dict.fromkeys("RGB", bright[..., 0]))):
        image = image_of(document, files={"picture": content})
        assert image[image.shape[0] // 2, image.shape[1] // 2].tolist() == [7.5] * 3


def test_bright_texture_in_a_mirror() -> None:
    """A path ends where nothing that it meets could be seen: a texture of 10^6 times white still is."""
    faint = phong([0, 0, 0], ambient=0.0, diffuse=0.0, mirror=5e-8)
    document = shown(encoding="linear")
    document["materials"] |= {"faint": faint}
    document["shapes"] = [
        rectangle([-9, -9, 0], [18, 0, 0], [0, 18, 0], material="faint"),
        rectangle([-99, -99, 20], [198, 0, 0], [0, 198, 0]),
    ]
    image = image_of(document, files={"picture": pfm(np.full((2, 2), 1e6, np.float32), "<")})
    assert image[8, 12].tolist() == pytest.approx([0.05] * 3, rel=1e-6)


@pytest.mark.parametrize(
    ("content", "texture", "said"),
    [
        (pfm(np.abs(LIGHT), "<"), {}, 'linear light: set "encoding": "linear"'),
        (pfm(LIGHT, "<"), {"encoding": "linear"}, f"values below 0, down to {LIGHT.min():.6g}"),
    ],
)
def test_values_that_are_no_colour(content: bytes, texture: dict[str, Any], said: str) -> None:
    with pytest.raises(renderer.SceneError) as caught:
        plan_of(shown(**texture), files={"picture": content})
    (problem,) = caught.value.errors
    assert (problem.pointer, problem.code) == ("/textures/a/asset", "asset")
    assert said in problem.detail


def alpha(mode: str, value: int) -> bytes:
    buffer = io.BytesIO()
    picture = Image.new("RGBA", (2, 2), (9, 9, 9, 255))
    picture.putpixel((1, 1), (9, 9, 9, value))
    picture.convert(mode).save(buffer, "PNG")
    return buffer.getvalue()


def with_alpha(value: int) -> dict[str, bytes]:
    """Pictures whose last pixel has an alpha of `value` / 255."""
    codes = np.full((2, 2, 4), 255, np.uint8)
    codes[1, 1, 3] = value
    planes = {name: codes[..., i] / np.float32(255) for i, name in enumerate("RGBA")}
    palette = Image.new("P", (2, 2), 0)
    palette.putpalette([9, 9, 9, 8, 8, 8])
    palette.putpixel((1, 1), 1)
    buffer = io.BytesIO()
    palette.save(buffer, "PNG", transparency=bytes([255, value]))
    deep = codes.astype(np.uint16) * 257
    return {
        "colours": alpha("RGBA", value),
        "grey": alpha("LA", value),
        "palette": buffer.getvalue(),
        "16 bits": deep_png(deep, 6),
        "16 bits of grey": deep_png(deep[..., 2:], 4),
        "tiff": tiff(deep, ">", 2, extra=2),
        "exr": exr(planes),
    }


@pytest.mark.parametrize("kind", with_alpha(0))
def test_unused_alpha_is_warned_of(kind: str) -> None:
    for value, count in ((255, 0), (254, 1)):
        plan = plan_of(shown(encoding="linear"), files={"picture": with_alpha(value)[kind]})
        found = [warning for warning in plan.warnings if warning.code == "asset"]
        assert [warning.pointer for warning in found] == ["/textures/a/asset"] * count
        assert all("alpha is not used" in warning.detail for warning in found)


def test_part_of_an_exr_file() -> None:
    planes = dict.fromkeys("RGB", np.full((2, 2), 0.25, np.float32))
    content = exr_of_parts(("depth", {"Z": planes["R"]}), ("beauty", planes))
    plan = plan_of(shown(encoding="linear"), files={"picture": content})
    (warning,) = (warning for warning in plan.warnings if warning.code == "asset")
    assert "part 2 of 2 ('beauty')" in warning.detail


def test_bump_map_of_16_bits() -> None:
    """A ramp over 512 of 65536 heights is as smooth in colours and with alpha as in grey."""
    ramp = np.tile(np.arange(0, 512, 8, dtype=np.uint16) + 32768, (4, 1))
    files = {
        "grey": deep_png(ramp[..., None], 0),
        "colours": deep_png(three(ramp), 2),
        "alpha": deep_png(np.stack([ramp, np.full_like(ramp, 65535)], axis=2), 4),
    }
    pictures = []
    for content in files.values():
        document = scene(
            rectangle([-3, -3, 0], [6, 0, 0], [0, 6, 0]),
            textures={"a": {"type": "image", "asset": "picture", "encoding": "linear"}},
            materials={"plain": phong(bump_map="a", bump_height=30.0)},
            lights=[{"type": "directional", "direction": [-1, 0, -1], "color": [1, 1, 1]}],
            background=[0, 0, 0],
        )
        pictures.append(image_of(json.loads(json.dumps(document)), files={"picture": content}))
    assert pictures[0].max() > 0
    assert all(np.array_equal(picture, pictures[0]) for picture in pictures[1:])
    middle = pictures[0][pictures[0].shape[0] // 2, :, 0]
    inside = middle[middle > 0][2:-2]
    assert inside.max() - inside.min() < 0.01 * inside.max()
