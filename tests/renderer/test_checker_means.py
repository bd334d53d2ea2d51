"""The mean of a checker board over a pixel's parallelogram, against exact arithmetic."""

from fractions import Fraction

import numpy as np
import pytest
from numpy.typing import NDArray

from renderer.textures import checker
from renderer.textures.checker import AveragedChecker
from schemas.textures import CheckerTexture
from tests.pictures.parts import Files

EPS = 2.0**-52
LONG = 64.0
"""Fields; beyond, the mean over a box is taken, which is as grey."""
Numbers = NDArray[np.float64]
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


def exact(center: Numbers, edges: Numbers) -> Fraction:
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


def means(centers: Numbers, edges: Numbers, repeat: tuple[float, float] = (1.0, 1.0)) -> Numbers:
    """Share of the even fields under footprints (2, 2, n) around places (2, n)."""
    shares: list[Numbers] = list(np.unique(AveragedChecker(board(repeat)).at(centers, edges), axis=0))
    assert len(shares) == 1
    return shares[0]


def mean(center: Numbers, edges: Numbers, repeat: tuple[float, float] = (1.0, 1.0)) -> float:
    return float(means(center[:, None], edges[:, :, None], repeat)[0])


def bound(edges: Numbers) -> float:
    """Of the error of a share, from the length l of the longest side in fields.

    Places on edges are off by 4 eps (1 + l). Four edges climb l each and pass 4 (1 + l) whole numbers, where
    the wave turns by 2: the integral is off by 12 (1 + l) such errors. A share is half a wave; mixing rounds.
    """
    longest = np.abs(edges).max()
    return float(24 * EPS * (1 + longest) ** 2 / abs(np.linalg.det(edges))) + 4 * EPS


def check(center: Numbers, edges: Numbers) -> None:
    assert abs(Fraction(mean(center, edges)) - exact(center, edges)) <= bound(edges)


def turned(angle: float, edges: Numbers) -> Numbers:
    (c, s) = np.cos(angle), np.sin(angle)
    return np.array([[c, -s], [s, c]]) @ edges


@pytest.mark.parametrize("size", [0.05, 0.4, 1.5, 6.0])
@pytest.mark.parametrize("seed", range(5))
def test_checker_mean_over_a_parallelogram(seed: int, size: float) -> None:
    """Sheared, of either orientation, from less than a field to many fields."""
    random = np.random.default_rng(seed)
    for _ in range(12):
        edges = random.uniform(-size, size, (2, 2))
        center = random.integers(-5, 5, 2) + random.uniform(-size, size, 2) / 2
        check(center, edges)
        check(center, edges[:, ::-1])


@pytest.mark.parametrize("axis", [0, 1])
@pytest.mark.parametrize("edges", [[[0.4, 0.2], [-0.1, 0.3]], [[2.5, 1.0], [0.5, -1.5]]])
def test_checker_mean_is_continuous(axis: int, edges: list[list[float]]) -> None:
    """A step sweeps over as much as it is long times the reach across it, in front and behind."""
    sides, steps = np.array(edges), np.linspace(-1.5, 1.5, 3001)
    centers = np.full((2, steps.size), 0.45)
    centers[axis] = 1 + steps
    found = means(centers, np.repeat(sides[:, :, None], steps.size, axis=2))
    across = np.abs(sides[1 - axis]).sum()
    most = np.diff(steps).max() * across / abs(np.linalg.det(sides)) + 2 * bound(sides)
    assert np.abs(np.diff(found)).max() <= most
    assert np.ptp(found) > 20 * most


def test_footprint_is_free_of_its_batch() -> None:
    """Among them small and large ones, some in one field, some flat, some too large."""
    random = np.random.default_rng(4)
    sizes = np.exp2(random.uniform(-8, 8, 400))
    edges = random.uniform(-1, 1, (2, 2, 400)) * sizes
    edges[:, 1, ::7] = edges[:, 0, ::7]
    centers = random.uniform(-4, 4, (2, 400))
    together = means(centers, edges)
    alone = [mean(centers[:, i], edges[:, :, i]) for i in range(400)]
    assert together.tolist() == alone
    order = random.permutation(400)
    assert means(centers[:, order], edges[:, :, order]).tolist() == together[order].tolist()


@pytest.mark.parametrize(
    "edges",
    [
        [[0.8, 0.8], [0.5, 0.5]],
        [[0.8, 0.0], [0.5, 0.0]],
        [[3.0, 3.0], [1.0, 1.0 + 2.0**-22]],
        [[LONG * 1.01, 0.3], [0.0, 0.8]],
        [[1e9, 3e8], [-2e8, 4e9]],
        [[1e150, 3e149], [-2e149, 1e150]],
    ],
    ids=["flat", "a line", "nearly flat", "too large", "far too large", "huge"],
)
def test_flat_and_huge_footprints(edges: list[list[float]]) -> None:
    sides = np.array(edges)[:, :, None].repeat(50, axis=2)
    centers = np.random.default_rng(5).uniform(-2, 2, (2, 50))
    reach = np.abs(sides).sum(axis=1) / 2
    centers[0] = np.rint(centers[0]) + reach[0] * 0.3  # beside a border, that none lies in one field
    found = means(centers, sides)
    assert found.tolist() == board().at(centers, sides)[0].tolist()
    assert (found >= 0).all()
    assert (found <= 1).all()
