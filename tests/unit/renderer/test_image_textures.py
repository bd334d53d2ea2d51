"""Image textures: which way up they are, and what comes before filtering, which hard cases G1 to G4 judge."""

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
