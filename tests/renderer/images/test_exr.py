"""EXR files hold the picture and its layers bit for bit."""

import io
import sys
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
import OpenEXR
import pytest
from numpy.typing import NDArray

from renderer import ImageFileError
from renderer.errors import MissingExtraError
from renderer.images.files import decode_exr, encode_exr, write_exr
from renderer.layers import LAYERS
from tests.renderer.picture_files import exr, exr_of_parts

SIZE = (5, 7)


def noise(dtype: Any, *shape: int) -> NDArray[Any]:
    """Any bits there are: also NaN, infinities, denormal and negative numbers."""
    bits = np.random.default_rng(3).integers(0, 1 << 32, shape, dtype=np.uint32)
    return bits.view(dtype)


IMAGE = noise(np.float32, *SIZE, 3)
ALL_LAYERS = {name: noise(layer.dtype, *layer.blank(*SIZE).shape) for name, layer in LAYERS.items()}


def channels_of(content: bytes) -> Any:
    return OpenEXR.File(io.BytesIO(content), separate_channels=True).channels()


def test_exr_is_read_back_bit_for_bit() -> None:
    content = encode_exr(IMAGE, ALL_LAYERS)
    assert content == encode_exr(IMAGE, ALL_LAYERS)
    pixels, found = decode_exr(content)
    assert (pixels.dtype, pixels.tobytes()) == (np.float32, IMAGE.tobytes())
    assert list(found) == list(ALL_LAYERS)
    for name, values in ALL_LAYERS.items():
        assert (found[name].dtype, found[name].shape) == (values.dtype, values.shape)
        assert found[name].tobytes() == values.tobytes(), name


@pytest.mark.parametrize("cuts", [(0, 1, 2, 3, 4, 5), (0, 3, 5)])
def test_exr_in_bands_is_the_file_of_the_whole(cuts: tuple[int, ...], tmp_path: Path) -> None:
    bands = (
        (IMAGE[top:end], {name: values[top:end] for name, values in ALL_LAYERS.items()})
        for top, end in pairwise(cuts)
    )
    write_exr(str(tmp_path / "a.exr"), SIZE, bands, tuple(ALL_LAYERS))
    assert (tmp_path / "a.exr").read_bytes() == encode_exr(IMAGE, ALL_LAYERS)


def test_exr_channels_have_their_usual_names() -> None:
    """A shape that is missed is the largest number without a sign."""
    layers = {name: ALL_LAYERS[name] for name in ("depth", "normal", "albedo", "uv")}
    layers["shape"] = np.full(SIZE, -1, np.int32)
    channels = channels_of(encode_exr(np.zeros((*SIZE, 3)), layers))
    assert set(channels) == {
        *("R", "G", "B", "depth.Z", "normal.X", "normal.Y", "normal.Z", "shape.id"),
        *("albedo.R", "albedo.G", "albedo.B", "uv.U", "uv.V"),
    }
    assert np.array_equal(channels["normal.Y"].pixels, layers["normal"][..., 1], equal_nan=True)
    assert channels["shape.id"].pixels.dtype == np.uint32
    assert (channels["shape.id"].pixels == 4294967295).all()


def test_exr_of_another_program_is_read() -> None:
    half = np.random.default_rng(3).random(SIZE).astype(np.float16)
    pixels, layers = decode_exr(exr(dict.fromkeys(("R", "G", "B", "A", "normal.X", "depth.Z"), half)))
    assert np.array_equal(pixels[..., 1], half.astype(np.float32))
    assert list(layers) == ["depth"]


@pytest.mark.parametrize("top", [-300, 0, 400])
def test_exr_of_many_rows_is_placed(top: int) -> None:
    """More rows than are decoded at once, of two types, some of them above or below the picture."""
    rows = np.random.default_rng(4).random((700, 3), np.float32).astype(np.float16)
    windows = {"displayWindow": ((0, 0), (2, 599)), "dataWindow": ((0, top), (2, top + 699))}
    pixels, _ = decode_exr(exr({"R": rows, "G": -rows.astype(np.float32), "B": rows}, **windows))
    expected = np.zeros((600, 3), np.float32)
    shown = rows[max(0, -top) : 600 - top]
    expected[max(0, top) :][: len(shown)] = shown
    assert np.array_equal(pixels, np.stack([expected, -expected, expected], axis=-1))


@pytest.mark.parametrize(
    "content",
    [b"", b"\x89PNG\r\n\x1a\n", b"v/1\x01", exr({"Z": np.zeros(SIZE, np.float32)})],
    ids=["empty", "png", "cut short", "depth alone"],
)
def test_exr_without_a_picture_is_refused(content: bytes) -> None:
    with pytest.raises(ImageFileError):
        decode_exr(content)


def test_exr_part_after_a_damaged_one_is_not_confused() -> None:
    """The library leaves out parts that it cannot decode, and counts the others anew."""
    wavy = np.tile(np.random.default_rng(1).random((40, 10), np.float32), 4)
    colors = [dict.fromkeys("RGB", np.full((40, 40), value, np.float32)) for value in (0.25, 0.75)]
    whole = exr_of_parts(("depth", {"Z": wavy}), ("first", colors[0]), ("second", colors[1]))
    assert (decode_exr(whole)[0] == 0.25).all()
    place = whole.index(b"\x78\x5e") + 200
    with pytest.raises(ImageFileError):
        decode_exr(whole[:place] + bytes(64) + whole[place + 64 :])


def test_exr_extra_is_named_where_it_is_missing(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "OpenEXR", None)
    for attempt in (lambda: encode_exr(IMAGE), lambda: decode_exr(b"")):
        with pytest.raises(MissingExtraError, match=r"penumbra-render\[exr\]"):
            attempt()
