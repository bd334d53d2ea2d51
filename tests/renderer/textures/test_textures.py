"""Checkerboards and images at points."""

import math
from typing import Any

import numpy as np
import pytest

from renderer.textures import checker, image
from schemas.textures import CheckerTexture, ImageTexture
from tests.pictures.parts import Files, png

EVEN, ODD = (0.9, 0.8, 0.7), (0.1, 0.2, 0.3)


@pytest.mark.parametrize("repeat", [(8, 8), (2, 64), (0.5, 1), (7.3, 4.1), (1e15, 3)])
def test_checker_fields_alternate(repeat: tuple[float, float]) -> None:
    """Just below 0 is another field, and far away a field is still one of the two."""
    document = {"type": "checker", "even": EVEN, "odd": ODD, "repeat": repeat}
    source = checker.build(CheckerTexture.model_validate(document), Files())
    places = [*np.random.default_rng(1).uniform(-5, 5, (300, 2)), (0.0, 0.0), (-0.0, 1 / 8), (1 / 8, 1 / 8)]
    places += [(-1e-17, 0.0), (-1e-300, -1e-17), (1 - 2.0**-53, 0.99), (-1e15, 1e15)]
    for u, v in places:
        color = tuple(source.at(np.array([[u], [v]]))[:, 0])
        fields = math.floor(u * repeat[0]) + math.floor(v * repeat[1])
        assert color == (EVEN if fields % 2 == 0 else ODD), (u, v)


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


def test_image_is_filtered_in_linear_light() -> None:
    source = texture([[0, 255]], encoding="srgb", filter="bilinear")
    assert value(source, 0.5) == pytest.approx(127.5, abs=1e-4)
    assert value(source, 0.25) == 0
    linear = ((100 / 255 + 0.055) / 1.055) ** 2.4
    assert value(texture([[100, 100]], encoding="srgb"), 0.5) / 255 == pytest.approx(linear, rel=1e-6)


def test_image_lookups_are_independent() -> None:
    source = texture(np.random.default_rng(2).integers(0, 256, (6, 5, 3)), filter="bilinear", wrap="mirror")
    coordinates = np.random.default_rng(3).uniform(-3, 4, (2, 500))
    together = source.at(coordinates)
    for i in range(0, 500, 71):
        assert (source.at(coordinates[:, i : i + 1])[:, 0] == together[:, i]).all()
