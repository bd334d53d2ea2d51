"""The checker board."""

import math

import numpy as np
import pytest

from renderer.textures import checker
from schemas.textures import CheckerTexture
from tests.images.parts import Files

EVEN, ODD = (0.9, 0.8, 0.7), (0.1, 0.2, 0.3)


def board(repeat: tuple[float, float] = (8, 8)) -> checker.CheckerTexture:
    document = {"type": "checker", "even": EVEN, "odd": ODD, "repeat": repeat}
    return checker.build(CheckerTexture.model_validate(document), Files())


def is_even(source: checker.CheckerTexture, u: float, v: float) -> bool:
    color = tuple(source.at(np.array([[u], [v]]))[:, 0])
    assert color in (EVEN, ODD)
    return color == EVEN


def test_the_field_at_the_corner_is_even_and_its_neighbours_odd() -> None:
    source = board()
    assert is_even(source, 0.0, 0.0)
    assert not is_even(source, 1 / 8, 0.0)
    assert not is_even(source, 0.0, 1 / 8)
    assert is_even(source, 1 / 8, 1 / 8)


@pytest.mark.parametrize("repeat", [(8, 8), (2, 64), (0.5, 1), (7.3, 4.1)])
def test_fields_alternate_everywhere(repeat: tuple[float, float]) -> None:
    source = board(repeat)
    for u, v in np.random.default_rng(1).uniform(-5, 5, (300, 2)):
        fields = math.floor(u * repeat[0]) + math.floor(v * repeat[1])
        assert is_even(source, u, v) == (fields % 2 == 0)


@pytest.mark.parametrize("u", [-0.0, -1e-300, 1.0, 1 - 2.0**-53, -1.0, 1e15, -1e15])
def test_at_the_ends_of_its_coordinates_a_field_is_one_of_the_two(u: float) -> None:
    for v in (0.0, 0.99, -1e15):
        is_even(board((1e15, 3)), u, v)


def test_just_below_zero_is_the_other_field() -> None:
    assert not is_even(board(), -1e-17, 0.0)
    assert is_even(board(), -1e-17, -1e-17)
