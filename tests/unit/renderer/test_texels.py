"""Tables of texels and slopes against the textures that they are made of."""

import numpy as np
import pytest

from renderer.textures.heights import Heights
from renderer.textures.image import ImageTexture
from renderer.textures.texels import REACH, slopes, table

RNG = np.random.default_rng(7)
TEXELS = RNG.random((9, 14, 3)).astype(np.float32)
COORDINATES = RNG.uniform(-1.5, 2.5, (2, 300))
FOOTPRINTS = RNG.uniform(-0.6, 0.6, (2, 2, 300))
OFFSETS = RNG.uniform(-0.5, 0.5, (2, 11, 1)).astype(np.float32)


def places() -> np.ndarray:
    """Texture coordinates (2, K, n) of all offsets in all footprints."""
    return COORDINATES[:, None] + np.einsum("csn,sk->ckn", FOOTPRINTS, OFFSETS[:, :, 0].astype(np.float64))


@pytest.mark.parametrize("wrap", ["clamp", "repeat", "mirror"])
def test_a_table_mixes_the_texels_that_the_texture_does(wrap: str) -> None:
    texture = ImageTexture(TEXELS, "bilinear", wrap)
    found = table(TEXELS, wrap, nearest=False)
    values = found.at(found.centers(COORDINATES, FOOTPRINTS), OFFSETS, 3)
    expected = texture.at(places().reshape(2, -1)).reshape(3, 11, 300)
    # A place is rounded to float32 at up to 16 texels from the centre, and texels differ by 1 at most.
    assert np.abs(np.stack(values) - expected).max() <= 4 * REACH * 2.0**-24


@pytest.mark.parametrize("wrap", ["clamp", "repeat", "mirror"])
def test_a_table_takes_the_texel_that_a_place_falls_on(wrap: str) -> None:
    texture = ImageTexture(TEXELS, "nearest", wrap)
    found = table(TEXELS, wrap, nearest=True)
    values = np.stack(found.at(found.centers(COORDINATES, FOOTPRINTS), OFFSETS, 3))
    expected = texture.at(places().reshape(2, -1)).reshape(3, 11, 300)
    texels = places() * np.array([14, 9])[:, None, None]
    inside = (np.abs(texels - np.rint(texels)) > 1e-4).all(axis=0)
    assert inside.mean() > 0.99
    assert (values[:, inside] == expected[:, inside]).all()


@pytest.mark.parametrize("wrap", ["clamp", "repeat"])
def test_tables_of_slopes_are_differences_over_a_texel(wrap: str) -> None:
    heights = Heights(ImageTexture(TEXELS, "bilinear", wrap), 0.3)
    expected = heights.slopes(places().reshape(2, -1))
    tables = slopes(0.3 * TEXELS.astype(np.float64).mean(axis=2), wrap)
    for found, slope in zip(tables, expected, strict=True):
        (values,) = found.at(found.centers(COORDINATES, FOOTPRINTS), OFFSETS, 1)
        assert np.abs(values - slope.reshape(11, 300)).max() <= 14 * 4 * REACH * 2.0**-24


def test_footprints_that_reach_too_far_are_shrunk_to_the_table() -> None:
    found = table(TEXELS, "repeat", nearest=False)
    sides = found.centers(COORDINATES, 1e6 * FOOTPRINTS).sides
    assert np.abs(sides).sum(axis=1).max() / 2 <= REACH * (1 + 2.0**-20)
