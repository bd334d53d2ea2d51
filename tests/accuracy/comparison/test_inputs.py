"""Pictures from files: numbers as they are meant, and a clear word where they cannot be used."""

import io
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from PIL import Image

from accuracy.comparison import NotComparableError, picture_of, read_picture
from renderer.images.files import encode_exr
from renderer.images.reading import decode_image
from tests.renderer.picture_files import deep_png, exr, exr_of_parts


def png(codes: np.ndarray, mode: str | None = None) -> bytes:
    buffer = io.BytesIO()
    picture = Image.fromarray(codes)
    (picture.convert(mode) if mode else picture).save(buffer, format="PNG")
    return buffer.getvalue()


def npy(values: np.ndarray) -> bytes:
    buffer = io.BytesIO()
    np.save(buffer, values)
    return buffer.getvalue()


CODES = np.arange(24, dtype=np.uint8).reshape(2, 4, 3) * 10


def literal_linear(code: float) -> float:
    x = code / 255
    return x / 12.92 if x <= 0.04045 else ((x + 0.055) / 1.055) ** 2.4


def test_png_is_srgb_unless_stated() -> None:
    usual, stated = picture_of(png(CODES), "a.png"), picture_of(png(CODES), "a.png", "linear")
    assert (usual.encoding, usual.stated) == ("srgb", False)
    assert (stated.encoding, stated.stated) == ("linear", True)
    # The decoder answers in float32.
    expected = [literal_linear(int(code)) for code in CODES.flat]
    assert usual.linear.ravel().tolist() == pytest.approx(expected, rel=2.0**-22)
    assert stated.linear.ravel().tolist() == [code / 255 for code in CODES.ravel().tolist()]


def test_floating_point_is_linear_and_clipped() -> None:
    values = np.full((2, 2, 3), 0.5, np.float32)
    values[0, 0, 0], values[1, 1, 2] = 3.0, -1.0
    picture = picture_of(npy(values), "a.npy")
    assert picture.encoding == "linear"
    assert picture.clipped == 2
    assert picture.linear[0, 0].tolist() == [1.0, 0.5, 0.5]
    assert picture.linear[1, 1].tolist() == [0.5, 0.5, 0.0]


def test_exr_comes_with_its_layers() -> None:
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


def test_layers_beside_a_file_belong_to_it(tmp_path: Path) -> None:
    (tmp_path / "a.npy").write_bytes(npy(np.zeros((2, 3, 3), np.float32)))
    (tmp_path / "a.npy.samples.npy").write_bytes(npy(np.full((2, 3), 9, np.int32)))
    assert read_picture(tmp_path / "a.npy").layers["samples"].tolist() == [[9, 9, 9]] * 2
    with pytest.raises(NotComparableError, match=r"none\.png"):
        read_picture(tmp_path / "none.png")


def test_layers_packed_with_a_picture_belong_to_it(tmp_path: Path) -> None:
    image = np.full((4, 6, 3), 0.5, np.float32)
    samples = np.full((4, 6), 16)
    np.savez(tmp_path / "reference.npz", image=image, samples=samples)
    found = read_picture(tmp_path / "reference.npz")
    np.testing.assert_array_equal(found.linear, image)
    np.testing.assert_array_equal(found.layers["samples"], samples)
    np.savez(tmp_path / "other.npz", picture=image)
    with pytest.raises(NotComparableError, match="no array 'image'"):
        read_picture(tmp_path / "other.npz")


def test_grey_counts_in_all_channels_and_alpha_in_none() -> None:
    grey = picture_of(png(np.array([[0, 255]], np.uint8)), "grey.png")
    assert grey.linear.tolist() == [[[0, 0, 0], [1, 1, 1]]]
    assert "grey" in grey.notes[0]
    opaque = picture_of(png(CODES, "RGBA"), "opaque.png")
    assert opaque.linear.tolist() == picture_of(png(CODES), "a.png").linear.tolist()
    assert "alpha" in opaque.notes[0]
    luminance = picture_of(exr({"Y": PLANES["R"]}), "a.exr")
    assert luminance.linear.tolist() == np.stack([PLANES["R"]] * 3, axis=-1).tolist()
    palette = picture_of(png(CODES, "P"), "palette.png")
    assert palette.linear.shape == (2, 4, 3)


DEEP = np.random.default_rng(2).integers(0, 1 << 16, (3, 5, 4)) | [0, 0, 0, 65535]


@pytest.mark.parametrize(
    "content",
    [
        *(png(CODES, mode) for mode in ("RGB", "L", "LA", "1", "P", "RGBA")),
        *(deep_png(DEEP[..., shape], kind) for kind, shape in ((0, [0]), (2, [0, 1, 2]), (4, [0, 3]))),
        deep_png(DEEP, 6, interlaced=True),
        exr(dict(zip("RGB", DEEP[..., :3].transpose(2, 0, 1).astype(np.float32) / 65535, strict=True))),
    ],
)
def test_picture_has_the_same_numbers_as_a_texture(content: bytes) -> None:
    """Each has a reader of its own; the one of textures answers in float32."""
    compared = picture_of(content, "picture", "linear").linear
    np.testing.assert_array_equal(compared.astype(np.float32), decode_image(content))


@pytest.mark.parametrize(("kind", "shape"), [(0, [0]), (2, [0, 1, 2]), (4, [0, 3]), (6, [0, 1, 2, 3])])
def test_png_of_16_bits_is_read_to_the_last_digit(kind: int, shape: list[int]) -> None:
    """Code by code, in every form that PNG has for it; alpha is 1 everywhere."""
    codes = np.random.default_rng(1).integers(0, 1 << 16, (3, 5, 4))
    codes[..., 3] = 65535
    picture = picture_of(deep_png(codes[..., shape], kind), "deep.png", "linear")
    colors = codes[..., [0, 0, 0] if kind in {0, 4} else [0, 1, 2]]
    assert picture.linear.tolist() == (colors / 65535).tolist()
    assert picture.bits == 16
    assert picture.rounding.ravel().tolist() == pytest.approx([0.5 / 65535] * 45)
    usual = picture_of(deep_png(codes[..., shape], kind), "deep.png")
    assert usual.encoding == "srgb"
    assert usual.linear[1, 2, 0] == pytest.approx(literal_linear(codes[1, 2, 0] / 257), rel=2.0**-22)


PLANES = {name: np.random.default_rng(i).random((2, 3), np.float32) for i, name in enumerate("RGBA")}
LIGHT = np.stack([PLANES[name] for name in "RGB"], axis=-1)
OPAQUE = np.ones((2, 3), np.float32)


def layer(name: str, *, alpha: bool = False) -> dict[str, np.ndarray]:
    planes = {f"{name}.{color}": PLANES[color] for color in "RGB"}
    return {**planes, f"{name}.A": OPAQUE} if alpha else planes


@pytest.mark.parametrize(
    ("content", "notes"),
    [
        (exr({**PLANES, "A": OPAQUE}), ["alpha is 1 everywhere"]),
        (
            exr_of_parts(("depth", {"Z": OPAQUE}), ("beauty", PLANES | {"A": OPAQUE})),
            ["part 2 of 2", "alpha"],
        ),
        (
            exr(
                {
                    **dict.fromkeys(("ViewLayer.AO.R", "ViewLayer.AO.G", "ViewLayer.AO.B"), OPAQUE),
                    **layer("ViewLayer.Combined", alpha=True),
                    "ViewLayer.Depth.Z": OPAQUE,
                }
            ),
            ["the layer 'ViewLayer.Combined'", "alpha"],
        ),
        (exr({**layer("diffuse"), "specular.R": OPAQUE}), ["the layer 'diffuse'"]),
        (
            exr_of_parts(("a", {"Z": OPAQUE}), ("b", layer("View.Combined"))),
            ["part 2 of 2 ('b') and the layer"],
        ),
    ],
    ids=["alpha", "second part", "Blender", "one layer", "a layer of a part"],
)
def test_exr_of_other_programs_is_read_and_the_choice_noted(content: bytes, notes: list[str]) -> None:
    picture = picture_of(content, "a.exr")
    assert picture.linear.tolist() == LIGHT.tolist()
    assert len(picture.notes) == len(notes)
    assert all(words in note for words, note in zip(notes, picture.notes, strict=True))


@pytest.mark.parametrize("corner", [(0, 0), (-3, 2)])
def test_data_window_lies_in_the_display_window(corner: tuple[int, int]) -> None:
    """One column of three lies outside; around the others it is black, and layers have no samples there."""
    x, y = corner
    windows = {"displayWindow": ((x, y), (x + 3, y + 4)), "dataWindow": ((x + 2, y + 1), (x + 4, y + 2))}
    samples = np.full((2, 3), 9, np.uint32)
    planes = {name: PLANES[name] for name in "RGB"} | {"samples.count": samples}
    picture = picture_of(exr(planes, **windows), "a.exr")
    expected = np.zeros((5, 4, 3), np.float32)
    expected[1:3, 2:4] = LIGHT[:, :2]
    assert picture.linear.tolist() == expected.tolist()
    assert picture.layers["samples"].tolist() == (expected.any(axis=2) * 9).tolist()
    assert "columns 2 to 3, rows 1 to 2" in picture.notes[0]


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
        (png(clear()), "transparent"),
        (deep_png(np.array([[[1, 2, 3, 65534]]]), 6), "transparent"),
        (deep_png(np.array([[[9, 65534]]]), 4), "transparent"),
        (deep_png(np.array([[[1, 2, 3]]]), 2, tRNS=b"\0\1\0\2\0\3"), "transparent"),
        (deep_png(CODES, 2)[:60], "damaged"),
        (exr(PLANES), "transparent"),
        (
            exr({**PLANES, "A": OPAQUE}, displayWindow=((0, 0), (3, 1)), dataWindow=((0, 0), (2, 1))),
            "transparent",
        ),
        (exr({"Z": OPAQUE}), "no picture; its channels are Z"),
        (exr({name: plane.astype(np.uint32) for name, plane in PLANES.items()}), "whole numbers"),
        (npy(with_nan()), "column 3, row 2"),
        (npy(np.full((2, 2, 3), np.inf)), "infinite"),
        (npy(np.zeros((2, 2, 5), np.float32)), "shape"),
        (npy(np.zeros((0, 2, 3), np.float32)), "no pixels"),
        (npy(np.zeros((2, 2, 3), np.complex64)), "complex64"),
        (npy(np.zeros((2, 2, 3), np.uint8)), "State the encoding"),
        (npy(np.zeros(7, np.float32)), "shape"),
    ],
)
def test_what_is_no_picture_is_refused(content: bytes, word: str) -> None:
    with pytest.raises(NotComparableError, match=word):
        picture_of(content, "picture")


def test_rounding_is_half_a_code_or_two_float32_spacings() -> None:
    eight = picture_of(png(np.array([[0, 255]], np.uint8)), "a.png", "linear")
    assert eight.rounding[0, 0, 0] == 0.5 / 255
    floating = picture_of(npy(np.full((1, 1, 3), 0.5, np.float32)), "a.npy")
    assert floating.rounding[0, 0, 0] == 2 * np.spacing(np.float32(0.5))


def test_layers_of_another_size_are_refused(tmp_path: Path) -> None:
    layers: dict[str, Any] = {"samples": np.ones((3, 3))}
    with pytest.raises(NotComparableError, match="'samples'"):
        picture_of(npy(np.zeros((2, 2, 3))), "a.npy", layers=layers)
