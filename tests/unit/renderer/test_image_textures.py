"""Image textures between, on and beyond their texels."""

import math
from fractions import Fraction
from typing import Any

import numpy as np
import pytest

from renderer.images.colors import linear_from_srgb
from renderer.textures import image
from schemas.textures import ImageTexture
from tests.images.parts import Files, png

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
def test_at_its_centre_a_texel_has_its_own_value(filter_: str, wrap: str) -> None:
    """Row 0 of the file is on the side v = 1."""
    codes = np.arange(0, 240, 16).reshape(3, 5)
    source = texture(codes, filter=filter_, wrap=wrap)
    for row in range(3):
        for column in range(5):
            found = value(source, (column + 0.5) / 5, 1 - (row + 0.5) / 3)
            assert found == pytest.approx(codes[row, column], abs=1e-4)


def wrapped(wrap: str, index: int, size: int) -> int:
    if wrap == "clamp":
        return min(max(index, 0), size - 1)
    index %= size if wrap == "repeat" else 2 * size
    return index if index < size else 2 * size - 1 - index


PLACES = [
    *(Fraction(k, 16) for k in range(-40, 57)),
    Fraction(-1, 2**30),
    Fraction(1) - Fraction(1, 2**30),
    Fraction(2**20) + Fraction(1, 4),
    Fraction(-(2**20)) + Fraction(1, 8),
]


@pytest.mark.parametrize("wrap", WRAPS)
@pytest.mark.parametrize("ramp", [[10, 200], [0, 255, 30, 90, 140], [77]], ids=["two", "five", "one"])
def test_bilinear_is_exact_between_texels_and_beyond_the_borders(ramp: list[int], wrap: str) -> None:
    """Against rational numbers."""
    source = texture([ramp], filter="bilinear", wrap=wrap)
    for u in PLACES:
        x = u * len(ramp) - Fraction(1, 2)
        i = math.floor(x)
        a, b = (ramp[wrapped(wrap, k, len(ramp))] for k in (i, i + 1))
        assert value(source, float(u)) == pytest.approx(float(a + (x - i) * (b - a)), abs=1e-4)


@pytest.mark.parametrize("wrap", WRAPS)
def test_nearest_takes_the_texel_that_holds_the_place(wrap: str) -> None:
    ramp = [0, 255, 30, 90, 140]
    source = texture([ramp], filter="nearest", wrap=wrap)
    for u in PLACES:
        expected = ramp[wrapped(wrap, math.floor(u * 5), 5)]
        assert value(source, float(u)) == pytest.approx(expected, abs=1e-4)


@pytest.mark.parametrize(
    "u", [-1e-9, -1e-17, -0.0, 0.0, 1.0, 1 - 2.0**-25, -1.0, -1.5, 1e9 + 0.25, -1e15, 1e15]
)
@pytest.mark.parametrize("filter_", FILTERS)
@pytest.mark.parametrize("wrap", WRAPS)
def test_no_coordinate_leaves_the_image(filter_: str, wrap: str, u: float) -> None:
    codes = np.arange(256).reshape(1, 256)
    found = value(texture(codes, filter=filter_, wrap=wrap), u)
    assert 0 <= found <= 255.0001
    if wrap == "clamp":
        assert found == pytest.approx(0 if u <= 0 else 255, abs=1e-4)


def test_under_repeat_one_is_zero_again() -> None:
    codes = np.arange(256).reshape(1, 256)
    for filter_ in FILTERS:
        source = texture(codes, filter=filter_, wrap="repeat")
        assert value(source, 1.0) == value(source, 0.0) == value(source, -3.0)
    assert value(texture(codes, filter="bilinear", wrap="repeat"), -1e-9) == pytest.approx(127.5, abs=1e-3)


@pytest.mark.parametrize("size", [(1, 1), (1, 7), (7, 1), (2, 2), (3, 5)])
@pytest.mark.parametrize("filter_", FILTERS)
@pytest.mark.parametrize("wrap", WRAPS)
def test_a_constant_stays_constant_bit_for_bit(filter_: str, wrap: str, size: tuple[int, int]) -> None:
    source = texture(np.full(size, 77), filter=filter_, wrap=wrap)
    coordinates = np.random.default_rng(1).uniform(-3, 4, (2, 2000))
    assert (source.at(coordinates) == float(np.float32(77) / np.float32(255))).all()


def test_colours_are_filtered_after_they_are_made_linear() -> None:
    source = texture([[0, 255]], encoding="srgb", filter="bilinear")
    assert value(source, 0.5) == pytest.approx(127.5, abs=1e-4)
    assert value(source, 0.25) == 0
    dark = texture([[100, 100]], encoding="srgb")
    assert value(dark, 0.5) / 255 == float(linear_from_srgb(np.array([100 / 255], dtype=np.float32))[0])


def test_every_look_up_stands_alone() -> None:
    codes = np.random.default_rng(2).integers(0, 256, (6, 5, 3))
    source = texture(codes, filter="bilinear", wrap="mirror")
    coordinates = np.random.default_rng(3).uniform(-3, 4, (2, 500))
    together = source.at(coordinates)
    for i in range(0, 500, 71):
        assert (source.at(coordinates[:, i : i + 1])[:, 0] == together[:, i]).all()
