"""The mean of a checker board over a pixel's parallelogram, from its parts."""

from fractions import Fraction

import numpy as np
import pytest
from numpy.typing import NDArray

from renderer.textures import checker
from renderer.textures.averaged import AveragedTexture
from schemas.textures import CheckerTexture
from tests.images.parts import Files

EPS = 2.0**-52
PARTS = 4
"""Along each side of a pixel."""
Point = tuple[Fraction, Fraction]


def board(repeat: tuple[float, float] = (1.0, 1.0)) -> checker.BoxCheckerTexture:
    """Even fields are 1, odd ones 0."""
    document = {"type": "checker", "even": [1, 1, 1], "odd": [0, 0, 0], "repeat": repeat, "filter": "box"}
    texture = checker.build(CheckerTexture.model_validate(document), Files())
    assert isinstance(texture, checker.BoxCheckerTexture)
    return texture


def area(polygon: list[Point]) -> Fraction:
    turned = polygon[1:] + polygon[:1]
    return (
        abs(sum((a[0] * b[1] - b[0] * a[1] for a, b in zip(polygon, turned, strict=True)), Fraction(0))) / 2
    )


def beyond(polygon: list[Point], axis: int, bound: int, side: int) -> list[Point]:
    """The part of a convex polygon where side * (p[axis] - bound) >= 0 (Sutherland, Hodgman 1974)."""
    found: list[Point] = []
    for a, b in zip(polygon, polygon[1:] + polygon[:1], strict=True):
        here, there = side * (a[axis] - bound), side * (b[axis] - bound)
        if here >= 0:
            found.append(a)
        if here * there < 0:
            share = here / (here - there)
            found.append((a[0] + share * (b[0] - a[0]), a[1] + share * (b[1] - a[1])))
    return found


def exact(center: NDArray[np.float64], edges: NDArray[np.float64]) -> Fraction:
    """Share of a parallelogram on even fields of side 1; `edges` are its columns."""
    x, y, (a, b), (c, d) = *map(Fraction, center), map(Fraction, edges[0]), map(Fraction, edges[1])
    signs = ((-1, -1), (1, -1), (1, 1), (-1, 1))
    polygon = [(x + (s * a + t * b) / 2, y + (s * c + t * d) / 2) for s, t in signs]
    columns, rows = ([p[k] // 1 for p in polygon] for k in (0, 1))
    even = Fraction(0)
    for column in range(min(columns), max(columns) + 1):
        strip = beyond(beyond(polygon, 0, column, 1), 0, column + 1, -1)
        for row in range(min(rows), max(rows) + 1):
            if (column + row) % 2 == 0 and strip:
                even += area(beyond(beyond(strip, 1, row, 1), 1, row + 1, -1) or [(x, y)])
    return even / area(polygon)


def mean(texture: AveragedTexture, center: NDArray[np.float64], edges: NDArray[np.float64]) -> float:
    (value,) = set(texture.at(center[:, None], edges[:, :, None])[:, 0].tolist())
    return value


@pytest.mark.parametrize("seed", range(20))
def test_over_a_box_along_the_board_the_mean_is_exact(seed: int) -> None:
    """Its parts are boxes whose means are exact, and they fill it."""
    random = np.random.default_rng(seed)
    center, (width, height) = random.uniform(-3, 3, 2), random.uniform(0.05, 3, 2)
    for edges in (np.diag([width, height]), np.array([[0, width], [-height, 0]])):
        found = mean(AveragedTexture(board(), PARTS), center, edges)
        assert abs(found - exact(center, edges)) <= 64 * EPS / min(width, height) * PARTS


@pytest.mark.parametrize("seed", range(20))
def test_a_side_of_a_field_across_a_sheared_pixel_counts_by_its_share(seed: int) -> None:
    """The side meets the boxes of 7 of 16 parts at most; a line along a box cuts shares off it and off the
    parallelogram in it that differ by an eighth at most.
    """
    random = np.random.default_rng(seed)
    slant, height = random.uniform(-0.4, 0.4, 2)
    edges = np.array([[0.4, slant], [0.0, 0.3 + abs(height)]])
    texture = AveragedTexture(board(), PARTS)
    for offset in np.linspace(-0.45, 0.45, 19):
        center = np.array([1 + offset, 0.5])
        assert abs(mean(texture, center, edges) - exact(center, edges)) <= 7 / 16 / 8 + 64 * EPS


@pytest.mark.parametrize("seed", range(10))
def test_over_sheared_pixels_the_parts_are_nearer_than_one_box_around_all(seed: int) -> None:
    """Over many places on the board, by the root of the mean square."""
    random = np.random.default_rng(seed)
    edges = np.array([[0.5, 0.35], [-0.3, 0.45]]) * random.uniform(0.5, 2)
    errors: list[list[float]] = []
    for center in random.uniform(-2, 2, (60, 2)):
        truth = exact(center, edges)
        box, parts = (mean(AveragedTexture(board(), n), center, edges) for n in (1, PARTS))
        errors.append([float(box - truth), float(parts - truth)])
    one, several = np.sqrt((np.array(errors) ** 2).mean(axis=0))
    assert several < one / 3


def test_the_mean_over_all_places_is_that_of_the_board() -> None:
    edges = np.array([[0.7, 0.3], [-0.2, 0.6]])
    places = np.array([(x, y) for x in np.arange(64) / 32 for y in np.arange(64) / 32]).T
    footprints = np.repeat(edges[:, :, None], places.shape[1], axis=2)
    found = AveragedTexture(board(), PARTS).at(places, footprints)
    assert np.abs(found.mean(axis=1) - 0.5).max() <= 1e-12


def test_fields_need_not_be_square_nor_whole() -> None:
    """A board of other repeats is the unit board with coordinates of its own."""
    center, edges = np.array([0.31, -0.2]), np.array([[0.2, 0.05], [0.03, 0.15]])
    repeat = np.array([3.0, 0.5])
    found = mean(AveragedTexture(board((3.0, 0.5)), PARTS), center, edges)
    expected = mean(AveragedTexture(board(), PARTS), center * repeat, edges * repeat[:, None])
    assert abs(found - expected) <= 64 * EPS


def test_without_a_pixel_the_colour_is_that_of_the_field() -> None:
    source = board()
    places = np.array([[0.2, 1.2, 1.2], [0.3, 0.3, 1.3]])
    assert AveragedTexture(source, PARTS).at(places)[0].tolist() == [1, 0, 1]


def test_a_pixel_of_no_size_shows_its_field() -> None:
    places = np.array([[0.2, 1.2], [0.3, 0.3]])
    found = AveragedTexture(board(), PARTS).at(places, np.zeros((2, 2, 2)))
    assert found.tolist() == [[1, 0]] * 3
