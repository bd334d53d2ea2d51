"""Filtered textures against brute force and closed forms."""

import io
import tracemalloc
from fractions import Fraction

import numpy as np
import pytest
from PIL import Image

from renderer.textures import checker, mipmap
from renderer.textures.checker import mean_square_wave
from renderer.textures.image import ImageTexture
from renderer.textures.mipmap import halved, pyramid
from schemas import textures as language
from schemas.textures import CheckerTexture
from tests.pictures.parts import Files


def square_wave_mean(center: Fraction, width: Fraction) -> Fraction:
    """By adding up the whole fields and the two pieces, in exact fractions."""
    low, high = center - width / 2, center + width / 2
    total = Fraction(0)
    for field in range(low.__floor__(), high.__ceil__()):
        overlap = min(high, Fraction(field + 1)) - max(low, Fraction(field))
        total += overlap if field % 2 == 0 else -overlap
    return total / width


def test_square_wave_mean_is_exact() -> None:
    rng = np.random.default_rng(1)
    centers = rng.uniform(-9, 9, 400)
    widths = 2.0 ** rng.uniform(-20, 6, 400)
    found = mean_square_wave(centers, widths)
    exact = [float(square_wave_mean(Fraction(c), Fraction(w))) for c, w in zip(centers, widths, strict=True)]
    assert np.abs(found - exact).max() <= 2.0**-50 / widths.min()
    wide = widths > 0.1
    assert np.abs(found - exact)[wide].max() <= 1e-14


@pytest.mark.parametrize("width", [0.0, 1e-300, 2.0**-27, 1.0, 1e17, 1e200])
def test_square_wave_mean_stays_within_1(width: float) -> None:
    means = mean_square_wave(np.linspace(-3, 3, 61), np.full(61, width))
    assert np.abs(means).max() <= 1
    if width < 1e-3:
        assert set(means) == {-1.0, 1.0}
    if width > 1e3:
        assert np.abs(means).max() <= 1e-3


def board(**changes: object) -> checker.CheckerTexture | checker.BoxCheckerTexture:
    fields = {"type": "checker", "even": (0.9, 0.5, 0.25), "odd": (0.1, 0.4, 0.75), "repeat": (4.0, 6.0)}
    return checker.build(CheckerTexture.model_validate({**fields, "filter": "box", **changes}), {})  # type: ignore[arg-type]


def test_box_checker_is_the_mean_of_its_box() -> None:
    """Against exact means along either axis; without footprints it is the point."""
    rng = np.random.default_rng(2)
    coordinates, footprints = rng.uniform(-1, 2, (2, 30)), rng.uniform(-0.3, 0.3, (2, 2, 30))
    widths = np.abs(footprints).sum(axis=1)
    waves = [
        [float(square_wave_mean(Fraction(c * n), Fraction(w * n))) for c, w in zip(*each, strict=True)]
        for *each, n in zip(coordinates, widths, (4, 6), strict=True)
    ]
    even = (1 + np.prod(waves, axis=0)) / 2
    expected = np.multiply.outer([0.9, 0.5, 0.25], even) + np.multiply.outer([0.1, 0.4, 0.75], 1 - even)
    np.testing.assert_allclose(board().at(coordinates, footprints), expected, atol=1e-12)
    assert np.array_equal(board().at(coordinates), board(filter="none").at(coordinates))
    plain = board(even=(0.3, 0.1, 0.7), odd=(0.3, 0.1, 0.7)).at(coordinates, footprints)
    assert np.array_equal(plain, np.array([0.3, 0.1, 0.7])[:, None].repeat(30, axis=1))


SIZES = [(1, 1), (1, 5), (2, 2), (3, 7), (13, 8), (17, 1)]


def image(texels: np.ndarray, wrap: str = "repeat") -> ImageTexture:
    return ImageTexture(texels.astype(np.float32), "mipmap", wrap)


@pytest.mark.parametrize(("height", "width"), SIZES)
@pytest.mark.parametrize("wrap", ["clamp", "repeat", "mirror"])
def test_mipmap_of_a_constant_is_constant(height: int, width: int, wrap: str) -> None:
    color = np.array([0.3, 1 / 3, 0.7], dtype=np.float32)
    texture = pyramid(image(np.broadcast_to(color, (height, width, 3)), wrap))
    rng = np.random.default_rng(5)
    footprints = 2.0 ** rng.uniform(-9, 3, 200) * rng.uniform(-1, 1, (2, 2, 200))
    found = texture.at(rng.uniform(-2, 3, (2, 200)), footprints)
    assert np.array_equal(found, color.astype(np.float64)[:, None].repeat(200, axis=1))


@pytest.mark.parametrize("count", [1, 2, 3, 5, 8, 13])
def test_mipmap_texel_is_the_mean_of_what_it_covers(count: int) -> None:
    values = np.random.default_rng(count).integers(0, 256, count)
    size = max(1, count // 2)
    expected = []
    for i in range(size):
        low, high = Fraction(i * count, size), Fraction((i + 1) * count, size)
        covered = [max(Fraction(0), min(high, Fraction(j + 1)) - max(low, Fraction(j))) for j in range(count)]
        expected.append(float(sum(c * int(v) for c, v in zip(covered, values, strict=True)) / (high - low)))
    assert halved(values.astype(np.float64)) == pytest.approx(expected, rel=1e-14)


@pytest.mark.parametrize(("height", "width"), SIZES)
def test_mipmap_ends_at_the_mean_of_the_image(height: int, width: int) -> None:
    texels = np.random.default_rng(6).uniform(0, 1, (height, width, 3))
    levels = pyramid(image(texels)).levels
    assert levels[-1].texels.shape == (1, 1, 3)
    assert len(levels) == max(height, width).bit_length()
    assert levels[-1].texels[0, 0] == pytest.approx(texels.mean(axis=(0, 1)), rel=1e-6)


@pytest.mark.parametrize(
    ("across", "along", "level"),
    [
        ((0, 0), (0, 0), 0.0),
        ((1 / 16, 0), (0, 1 / 16), 0.0),
        ((1 / 8, 0), (0, 0), 1.0),
        ((0, 0), (0, -1 / 4), 2.0),
        ((1 / 4, 0), (0, 1 / 16), 2.0),
        ((3 / 16, 4 / 16), (0, 0), np.log2(5)),
        ((2**0.5 / 8, 0), (0, 0), 1.5),
        ((1, 0), (0, 0), 4.0),
        ((1e200, 0), (0, 1e200), 4.0),
    ],
)
def test_mipmap_level_follows_the_longer_side(
    across: tuple[float, float], along: tuple[float, float], level: float
) -> None:
    texture = pyramid(image(np.zeros((16, 16, 3))))
    for number, each in enumerate(texture.levels):
        each.texels[...] = number
    found = texture.at(np.full((2, 1), 0.4), np.array([across, along]).T[:, :, None])
    assert found[:, 0] == pytest.approx([level] * 3, abs=1e-12)


def test_mipmap_below_one_texel_is_bilinear() -> None:
    base = image(np.random.default_rng(7).uniform(0, 1, (5, 7, 3)))
    coordinates = np.random.default_rng(8).uniform(-2, 3, (2, 100))
    footprints = np.full((2, 2, 100), 1 / 16)
    assert np.array_equal(pyramid(base).at(coordinates, footprints), base.at(coordinates))


# With bands as large as they are; a texture of twice the side takes four times the memory.
@pytest.mark.slow
@pytest.mark.parametrize(("filter_", "most"), [("bilinear", 44), ("mipmap", 60)])
def test_texture_takes_little_more_memory_than_its_texels(filter_: str, most: int) -> None:
    file = io.BytesIO()
    Image.new("RGB", (2048, 2048), (10, 100, 200)).save(file, "PNG")
    texture = language.ImageTexture.model_validate({"type": "image", "asset": "a", "filter": filter_})
    tracemalloc.start()
    try:
        built = mipmap.build(texture, Files({"a": file.getvalue()}))
        peak = tracemalloc.get_traced_memory()[1]
    finally:
        tracemalloc.stop()
    assert isinstance(built, mipmap.MipmapTexture) == (filter_ == "mipmap")
    assert peak < most * 2048**2
