"""Checker boards and image textures at points, and the tables of texels that are made of them.

What hard cases G1 to G4 judge, places on and beyond the borders of images, is left to them.
"""

from typing import Any

import numpy as np
import pytest

from renderer.images.colors import linear_from_srgb
from renderer.textures import checker, image
from renderer.textures.heights import Heights
from renderer.textures.texels import REACH, slopes, table
from schemas.textures import CheckerTexture, ImageTexture
from tests.pictures.parts import Files, png

EVEN, ODD = (0.9, 0.8, 0.7), (0.1, 0.2, 0.3)


def board(repeat: tuple[float, float] = (8, 8)) -> checker.CheckerTexture:
    document = {"type": "checker", "even": EVEN, "odd": ODD, "repeat": repeat}
    return checker.build(CheckerTexture.model_validate(document), Files())


def is_even(source: checker.CheckerTexture, u: float, v: float) -> bool:
    color = tuple(source.at(np.array([[u], [v]]))[:, 0])
    assert color in (EVEN, ODD)
    return color == EVEN


def test_checker_field_at_the_corner() -> None:
    source = board()
    assert is_even(source, 0.0, 0.0)
    assert not is_even(source, 1 / 8, 0.0)
    assert not is_even(source, 0.0, 1 / 8)
    assert is_even(source, 1 / 8, 1 / 8)


@pytest.mark.parametrize("u", [-0.0, -1e-300, 1.0, 1 - 2.0**-53, -1.0, 1e15, -1e15])
def test_checker_at_extreme_coordinates(u: float) -> None:
    for v in (0.0, 0.99, -1e15):
        is_even(board((1e15, 3)), u, v)


def test_checker_below_zero() -> None:
    assert not is_even(board(), -1e-17, 0.0)
    assert is_even(board(), -1e-17, -1e-17)


WRAPS = ["clamp", "repeat", "mirror"]
FILTERS = ["nearest", "bilinear"]


def texture(codes: Any, **changes: Any) -> image.ImageTexture:
    document = {"type": "image", "asset": "a.png", "encoding": "linear", **changes}
    array = np.asarray(codes, dtype=np.uint8)
    if array.ndim == 2:
        array = np.repeat(array[:, :, None], 3, axis=2)
    return image.build(ImageTexture.model_validate(document), Files({"a.png": png(array)}))


def value(source: image.ImageTexture, u: float, v: float = 0.5) -> float:
    found = source.at(np.array([[u], [v]]))
    assert found.shape == (3, 1)
    return float(found[0, 0]) * 255


@pytest.mark.parametrize("wrap", WRAPS)
@pytest.mark.parametrize("filter_", FILTERS)
def test_texel_at_its_centre(filter_: str, wrap: str) -> None:
    """Row 0 of the file is on the side v = 1."""
    codes = np.arange(0, 240, 16).reshape(3, 5)
    source = texture(codes, filter=filter_, wrap=wrap)
    for row in range(3):
        for column in range(5):
            found = value(source, (column + 0.5) / 5, 1 - (row + 0.5) / 3)
            assert found == pytest.approx(codes[row, column], abs=1e-4)


def test_filtering_is_linear() -> None:
    source = texture([[0, 255]], encoding="srgb", filter="bilinear")
    assert value(source, 0.5) == pytest.approx(127.5, abs=1e-4)
    assert value(source, 0.25) == 0
    dark = texture([[100, 100]], encoding="srgb")
    assert value(dark, 0.5) / 255 == float(linear_from_srgb(np.array([100 / 255], dtype=np.float32))[0])


def test_look_ups_are_independent() -> None:
    codes = np.random.default_rng(2).integers(0, 256, (6, 5, 3))
    source = texture(codes, filter="bilinear", wrap="mirror")
    coordinates = np.random.default_rng(3).uniform(-3, 4, (2, 500))
    together = source.at(coordinates)
    for i in range(0, 500, 71):
        assert (source.at(coordinates[:, i : i + 1])[:, 0] == together[:, i]).all()


RNG = np.random.default_rng(7)
TEXELS = RNG.random((9, 14, 3)).astype(np.float32)
COORDINATES = RNG.uniform(-1.5, 2.5, (2, 300))
FOOTPRINTS = RNG.uniform(-0.6, 0.6, (2, 2, 300))
OFFSETS = RNG.uniform(-0.5, 0.5, (2, 11, 1)).astype(np.float32)


def places() -> np.ndarray:
    """Texture coordinates (2, K, n) of all offsets in all footprints."""
    return COORDINATES[:, None] + np.einsum("csn,sk->ckn", FOOTPRINTS, OFFSETS[:, :, 0].astype(np.float64))


@pytest.mark.parametrize("wrap", WRAPS)
def test_table_mixes_texels(wrap: str) -> None:
    texture = image.ImageTexture(TEXELS, "bilinear", wrap)
    found = table(TEXELS, wrap, nearest=False)
    values = found.at(found.centers(COORDINATES, FOOTPRINTS), OFFSETS, 3)
    expected = texture.at(places().reshape(2, -1)).reshape(3, 11, 300)
    # A place is rounded to float32 at up to 16 texels from the centre, and texels differ by 1 at most.
    assert np.abs(np.stack(values) - expected).max() <= 4 * REACH * 2.0**-24


@pytest.mark.parametrize("wrap", WRAPS)
def test_table_takes_a_texel(wrap: str) -> None:
    texture = image.ImageTexture(TEXELS, "nearest", wrap)
    found = table(TEXELS, wrap, nearest=True)
    values = np.stack(found.at(found.centers(COORDINATES, FOOTPRINTS), OFFSETS, 3))
    expected = texture.at(places().reshape(2, -1)).reshape(3, 11, 300)
    texels = places() * np.array([14, 9])[:, None, None]
    inside = (np.abs(texels - np.rint(texels)) > 1e-4).all(axis=0)
    assert inside.mean() > 0.99
    assert (values[:, inside] == expected[:, inside]).all()


@pytest.mark.parametrize("wrap", ["clamp", "repeat"])
def test_tables_of_slopes(wrap: str) -> None:
    heights = Heights(image.ImageTexture(TEXELS, "bilinear", wrap), 0.3)
    expected = heights.slopes(places().reshape(2, -1))
    tables = slopes(0.3 * TEXELS.astype(np.float64).mean(axis=2), wrap)
    for found, slope in zip(tables, expected, strict=True):
        (values,) = found.at(found.centers(COORDINATES, FOOTPRINTS), OFFSETS, 1)
        assert np.abs(values - slope.reshape(11, 300)).max() <= 14 * 4 * REACH * 2.0**-24


def test_far_footprints_are_shrunk() -> None:
    found = table(TEXELS, "repeat", nearest=False)
    sides = found.centers(COORDINATES, 1e6 * FOOTPRINTS).sides
    assert np.abs(sides).sum(axis=1).max() / 2 <= REACH * (1 + 2.0**-20)
