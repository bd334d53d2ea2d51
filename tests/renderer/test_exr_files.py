"""EXR files hold the picture and the layers as they are, and say so where they cannot."""

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
from renderer.images.files import decode_exr, encode_exr, write_exr, write_image
from renderer.layers import LAYERS
from schemas.scene import Display
from tests.renderer.picture_files import exr_of_parts

SIZE = (5, 7)


def noise(dtype: Any, *shape: int) -> NDArray[Any]:
    """Any bits there are: also NaN, infinities, denormal and negative numbers."""
    bits = np.random.default_rng(3).integers(0, 1 << 32, shape, dtype=np.uint32)
    return bits.view(dtype)


def all_layers() -> dict[str, NDArray[Any]]:
    return {name: noise(layer.dtype, *layer.blank(*SIZE).shape) for name, layer in LAYERS.items()}


def test_file_is_read_back() -> None:
    image, layers = noise(np.float32, *SIZE, 3), all_layers()
    pixels, found = decode_exr(encode_exr(image, layers))
    assert (pixels.dtype, pixels.tobytes()) == (np.float32, image.tobytes())
    assert list(found) == list(layers)
    for name, values in layers.items():
        assert (found[name].dtype, found[name].shape) == (values.dtype, values.shape)
        assert found[name].tobytes() == values.tobytes(), name


@pytest.mark.parametrize("cuts", [(0, 1, 2, 3, 4, 5), (0, 3, 5)])
def test_bands_equal_the_whole(cuts: tuple[int, ...], tmp_path: Path) -> None:
    image, layers = noise(np.float32, *SIZE, 3), all_layers()
    bands = (
        (image[top:end], {name: values[top:end] for name, values in layers.items()})
        for top, end in pairwise(cuts)
    )
    write_exr(str(tmp_path / "a.exr"), SIZE, bands, tuple(layers))
    assert (tmp_path / "a.exr").read_bytes() == encode_exr(image, layers)


def test_channel_names() -> None:
    layers = {name: all_layers()[name] for name in ("depth", "normal", "albedo", "uv", "shape")}
    content = encode_exr(np.zeros((*SIZE, 3)), layers)
    channels = OpenEXR.File(io.BytesIO(content), separate_channels=True).channels()
    assert set(channels) == {
        *("R", "G", "B", "depth.Z", "normal.X", "normal.Y", "normal.Z", "shape.id"),
        *("albedo.R", "albedo.G", "albedo.B", "uv.U", "uv.V"),
    }
    assert np.array_equal(channels["normal.Y"].pixels, layers["normal"][..., 1], equal_nan=True)
    assert channels["shape.id"].pixels.dtype == np.uint32


def test_shape_of_a_miss() -> None:
    content = encode_exr(np.zeros((*SIZE, 3)), {"shape": np.full(SIZE, -1, np.int32)})
    channels = OpenEXR.File(io.BytesIO(content), separate_channels=True).channels()
    assert np.all(channels["shape.id"].pixels == 4294967295)


def test_same_bytes() -> None:
    image, layers = noise(np.float32, *SIZE, 3), all_layers()
    assert encode_exr(image, layers) == encode_exr(image, layers)


def test_file_of_another_program() -> None:
    half = np.random.default_rng(3).random(SIZE).astype(np.float16)
    planes = {"R": half, "G": half, "B": half, "A": half, "normal.X": half, "depth.Z": half}
    buffer = io.BytesIO()
    OpenEXR.File({}, planes).write(buffer)
    pixels, layers = decode_exr(buffer.getvalue())
    assert np.array_equal(pixels[..., 1], half.astype(np.float32))
    assert list(layers) == ["depth"]


@pytest.mark.parametrize("content", [b"", b"\x89PNG\r\n\x1a\n", b"v/1\x01"])
def test_file_that_is_no_exr(content: bytes) -> None:
    with pytest.raises(ImageFileError, match="not an EXR file"):
        decode_exr(content)


def test_damaged_part() -> None:
    """The library leaves out parts that it cannot decode, and counts the others anew."""
    wavy = np.tile(np.random.default_rng(1).random((40, 10), np.float32), 4)
    colors = [dict.fromkeys("RGB", np.full((40, 40), value, np.float32)) for value in (0.25, 0.75)]
    whole = exr_of_parts(("depth", {"Z": wavy}), ("first", colors[0]), ("second", colors[1]))
    assert (decode_exr(whole)[0] == 0.25).all()
    place = whole.index(b"\x78\x5e") + 200
    damaged = whole[:place] + bytes(64) + whole[place + 64 :]
    left = OpenEXR.File(io.BytesIO(damaged), separate_channels=True)
    assert [part.name() for part in left.parts] == ["first", "second"]
    with pytest.raises(ImageFileError, match="not an EXR file that can be read"):
        decode_exr(damaged)


def test_missing_library_names_the_extra(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    monkeypatch.setitem(sys.modules, "OpenEXR", None)
    for attempt in (
        lambda: encode_exr(np.zeros((*SIZE, 3))),
        lambda: decode_exr(b""),
        lambda: write_image(tmp_path / "a.exr", np.zeros((*SIZE, 3)), Display()),
    ):
        with pytest.raises(MissingExtraError, match=r"penumbra-render\[exr\]"):
            attempt()
    assert list(tmp_path.iterdir()) == []
