"""Hard cases I: where the samples of a pixel lie, and what they add up to."""

import itertools
import math
import random
from collections.abc import Iterator
from fractions import Fraction
from functools import partial, reduce

import mpmath
import numpy as np

import renderer
from accuracy.hard_cases.documents import bulb, camera, lamp, phong, rectangle, room, sampled, scene
from accuracy.hard_cases.harness import (
    EPS,
    Cases,
    Outcome,
    Outcomes,
    compiled,
    exact,
    in_both,
    plain_only,
    tally,
)
from renderer.film import Film, compose
from renderer.layers import Spread, merged, standard_errors
from renderer.math.arrays import Floats
from renderer.math.numerics import halving_sum
from renderer.math.streams import bits, keys, uniforms
from renderer.samplers import PATTERNS
from renderer.tiling import passes
from schemas.tiles import Tile


def grid(n: int) -> tuple[Floats, Floats]:
    """Centres of n x n cells about the middle of a pixel, (n * n,) each."""
    index = np.arange(n * n)
    return (index % n + 0.5) / n - 0.5, (index // n + 0.5) / n - 0.5


def turned(n: int, size: float = 1.0) -> tuple[Floats, Floats]:
    """That grid turned by atan(1/2) and no more, in units of a pixel from its corner."""
    a, b = grid(n)
    return size * (2 * a - b) / math.sqrt(5) + 0.5, size * (a + 2 * b) / math.sqrt(5) + 0.5


@exact
def wrapped(n: int) -> tuple[list[float], list[float]]:
    """The same to 50 digits, each place brought back into the pixel by whole pixels."""
    columns: list[float] = []
    rows: list[float] = []
    root = mpmath.sqrt(5)
    for j, i in itertools.product(range(n), repeat=2):
        a, b = Fraction(2 * i + 1 - n, 2 * n), Fraction(2 * j + 1 - n, 2 * n)
        for places, offset in ((columns, 2 * a - b), (rows, a + 2 * b)):
            place = mpmath.mpf(offset.numerator) / offset.denominator / root + mpmath.mpf(1) / 2
            places.append(float(place - mpmath.floor(place)))
    return columns, rows


def _turned_grid(n: int) -> Outcome:
    bound = 2 * EPS
    found = np.array(PATTERNS["rotated"](keys(0), np.arange(n * n), n * n))
    off = (np.abs(found - wrapped(n)) > bound) | (found < 0) | (found >= 1)
    uneven = sum(abs(math.fsum(row) / len(row) - 0.5) > bound for row in found)
    crowded = sum(len(np.unique(row.round(12))) != 3 * n - 2 for row in found)
    x, y = turned(n)
    outside = (x < 0) | (x >= 1) | (y < 0) | (y >= 1)
    return Outcome(n * n, tally(off.any(axis=0)) + uneven + crowded, int(outside.sum()))


PICTURE = 4
"""Pixels a side of the picture that an edge crosses."""

SIDE = 16
"""Samples a side of each pixel."""

Line = tuple[Fraction, Fraction]
"""Where a line x = place + slope y crosses y = 0, and its slope."""


def lines(count: int) -> Iterator[Line]:
    """Lines across a picture of [-1, 1]^2, in numbers that doubles hold exactly."""
    chosen, unit = random.Random("lines"), 1 << 20
    for _ in range(count):
        place, slope = chosen.randint(-unit, unit), chosen.randint(-unit, unit)
        yield Fraction(place, unit), Fraction(slope, unit)


def shares(line: Line) -> dict[tuple[int, int], float]:
    """Share left of a line of each pixel (column, row) that it crosses."""
    place, slope = line
    step = Fraction(2, PICTURE)
    found = {}
    for i, j in itertools.product(range(PICTURE), repeat=2):
        left, low = i * step - 1, 1 - (j + 1) * step
        corners = [(left, low), (left + step, low), (left + step, low + step), (left, low + step)]
        depths = [place + slope * y - x for x, y in corners]
        if min(depths) < 0 < max(depths):
            found[i, j] = float(_area(_clipped(corners, depths)) / step**2)
    return found


_Polygon = list[tuple[Fraction, Fraction]]


def _clipped(corners: _Polygon, depths: list[Fraction]) -> _Polygon:
    """The part of a polygon where the depth, linear between corners, is at least 0."""
    kept = []
    for k, (here, depth) in enumerate(zip(corners, depths, strict=True)):
        there, other = corners[k - 1], depths[k - 1]
        if min(depth, other) < 0 < max(depth, other):
            share = depth / (depth - other)
            kept.append((here[0] + share * (there[0] - here[0]), here[1] + share * (there[1] - here[1])))
        if depth >= 0:
            kept.append(here)
    return kept


def _area(polygon: _Polygon) -> Fraction:
    pairs = zip(polygon, polygon[1:] + polygon[:1], strict=True)
    return abs(sum((p[0] * q[1] - q[0] * p[1] for p, q in pairs), Fraction(0))) / 2


def pictured(line: Line, pattern: str) -> Floats:
    """Picture of a white plane left of a line, (PICTURE, PICTURE)."""
    place, slope = map(float, line)
    beyond = 4.0
    white = rectangle(
        [place - slope * beyond, -beyond, -1], [2 * slope * beyond, 2 * beyond, 0], [-2 * beyond, 0, 0]
    )
    view = camera(position=[0, 0, 0], look_at=[0, 0, -1], vertical_fov=90, width=PICTURE, height=PICTURE)
    document = scene(
        white,
        camera=view,
        background=[0, 0, 0],
        ambient=[1, 1, 1],
        materials={"plain": phong([1, 1, 1], ambient=1, diffuse=0)},
        sampling=sampled(SIDE**2, pattern=pattern),
    )
    image = renderer.render(compiled(document)).image
    return image[:, :, 0].astype(np.float64)


def shrunk(line: Line, pixel: tuple[int, int]) -> float:
    """Share of samples left of a line, of the turned grid made small enough for its pixel."""
    a, b = turned(SIDE, size=math.sqrt(5) / 3)
    x, y = 2 * (pixel[0] + a) / PICTURE - 1, 1 - 2 * (pixel[1] + b) / PICTURE
    return float(np.mean(x < float(line[0]) + float(line[1]) * y))


def _edge(line: Line, true: dict[tuple[int, int], float]) -> Iterator[Outcomes]:
    plain = sum(abs(shrunk(line, pixel) - share) > 1 / SIDE for pixel, share in true.items())
    yield plain_only(plain)
    for pattern in ("uniform", "rotated", "stratified", "sobol", "random"):
        image = pictured(line, pattern)
        found = [(float(image[j, i]), share) for (i, j), share in true.items()]
        if pattern == "random":
            wrong = sum(unlikely(round(seen * SIDE**2), SIDE**2, share) for seen, share in found)
        else:
            wrong = sum(abs(seen - share) > 1 / SIDE for seen, share in found)
        yield Outcome(len(true), wrong)


def unlikely(hits: int, count: int, share: float) -> bool:
    """Whether so many hits or more, or so few or fewer, are a chance below 2^-15."""
    chances = [math.comb(count, k) * share**k * (1 - share) ** (count - k) for k in range(count + 1)]
    return min(math.fsum(chances[hits:]), math.fsum(chances[: hits + 1])) < 2.0**-15


def in_turn(side: int, tile: int, samples: int) -> Floats:
    """Places (side, side, samples, 2) in pixels, drawn tile after tile from one generator."""
    drawn, places = np.random.default_rng(1), np.empty((side, side, samples, 2))
    for y, x in itertools.product(range(0, side, tile), repeat=2):
        part = places[y : y + tile, x : x + tile]
        part[:] = drawn.random(part.shape)
    return places


def random_numbers_and_tiles() -> Iterator[Outcomes]:
    """A room with random places in pixels and on its lamp, in tiles of 3, 5 and 7 pixels and in one."""
    side = 16
    document = scene(
        *room(),
        lights=[lamp([-1, 3.9, -1], [2, 0, 0], [0, 0, 2]), bulb([1, 2, 1])],
        camera=camera(width=side, height=side),
        sampling=sampled(4, 4, "random", "random", seed=5),
    )
    plan = compiled(document)
    whole, drawn = renderer.render(plan).image, in_turn(side, side, 4)
    for size in (3, 5, 7):
        image, places = renderer.render(plan, tile_size=size).image, in_turn(side, size, 4)
        differ = [(a != b).reshape(side, side, -1).any(axis=2) for a, b in ((image, whole), (places, drawn))]
        yield Outcome(side * side, *map(tally, differ))


def below_one() -> Outcome:
    """The 1,000 smallest and largest sets of bits, and some between."""
    ends = np.arange(1000, dtype=np.uint32)
    drawn = np.concatenate((ends, ~ends, bits(keys(3), np.arange(2000))))
    found = uniforms(drawn)
    wrong = (found < 0) | (found >= 1) | (found.astype(np.float32) != found)
    plain = drawn * 2.0**-32
    counts = (wrong, plain >= 1, plain.astype(np.float32) >= 1)
    return Outcome(drawn.size, *map(tally, counts))


MILLION = 1_000_000


def brightnesses(count: int, seed: int) -> Floats:
    """Samples (3, count): all the same, at random, and one bright one before many dark ones."""
    drawn = np.random.default_rng(seed)
    last = np.full(count, drawn.random() / 1000)
    last[0] = 1e6
    return np.array([np.full(count, drawn.integers(1, 10) / 10), drawn.random(count), last])


def in_order(samples: Floats, dtype: type[np.floating]) -> Floats:
    """Sums (3,) of samples one after the other."""
    return np.cumsum(samples.astype(dtype), axis=1)[:, -1].astype(np.float64)


def _sums(samples: Floats) -> Outcome:
    true = np.array([math.fsum(row) for row in samples])
    found = (halving_sum(samples.T.copy()), *in_both(partial(in_order, samples)))
    return Outcome(3, *(tally(np.abs(sums / true - 1) > 1e-12) for sums in found))


def _pixels(count: int) -> Outcome:
    samples, zero, parts = brightnesses(count, seed=count), np.zeros(1, dtype=np.int64), []
    for pass_ in passes(1, 1, count)[1:]:
        film = Film(Tile(0, 0, 0, 1, 1), pass_)
        film.add(zero, zero, samples[:, pass_.first : pass_.last].copy())
        parts.append((pass_, film.image()))
    true = np.array([math.fsum(row) / count for row in samples])
    off = np.abs(compose(parts)[0, 0] / true - 1)
    return Outcome(3, tally(off > 2.0**-23))


def nearly_equal(count: int, seed: int) -> Floats:
    """Samples (3, count) about 1, a thousand and a million with a standard deviation of 1/100."""
    drawn = np.random.default_rng(seed)
    return np.array([[1.0], [1e3], [1e6]]) + drawn.normal(scale=0.01, size=(3, count))


def exact_variance(samples: list[float]) -> float:
    """Mean square of what samples differ from their mean, in rational numbers."""
    values = [Fraction(x) for x in samples]
    mean = sum(values, Fraction(0)) / len(values)
    return float(sum(((x - mean) ** 2 for x in values), Fraction(0)) / (len(values) - 1))


def plain_variances(samples: Floats, dtype: type[np.floating]) -> Floats:
    """The mean of the squares less the square of the mean, (3,)."""
    x = samples.astype(dtype)
    count = x.shape[1]
    variances = (x * x).mean(axis=1) - x.mean(axis=1) ** 2
    return variances.astype(np.float64) * count / (count - 1)


def nearly_equal_samples() -> Outcomes:
    """Pixels of 2 to 200 samples, in passes."""
    varied = [_spread(nearly_equal(count, seed=count)) for count in (2, 4, 16, 50, 200)]
    alike = errors_of(np.repeat([[0.1], [1e3], [1e30]], 100, axis=1))
    return [*varied, Outcome(3, tally(alike))]


def errors_of(samples: Floats) -> Floats:
    """Standard errors (3,) of the mean, of one pixel, as the renderer estimates them."""
    zero, records = np.zeros(1, dtype=np.int64), []
    for pass_ in passes(1, 1, samples.shape[1])[1:]:
        part = Spread(Tile(0, 0, 0, 1, 1), pass_)
        part.add(zero, zero, samples[:, pass_.first : pass_.last].copy())
        records.append(part.record)
    return standard_errors(reduce(merged, records))[0, 0].astype(np.float64)


def _spread(samples: Floats) -> Outcome:
    count = samples.shape[1]
    true = np.sqrt([exact_variance(row) / count for row in samples.tolist()])
    plain = in_both(lambda dtype: np.sqrt(plain_variances(samples, dtype) / count))
    found = (errors_of(samples), *plain)
    return Outcome(3, *(tally(~(np.abs(e / true - 1) <= 2.0**-23)) for e in found))


CASES: Cases = {
    "I1: a turned grid that leaves the pixel": lambda: (_turned_grid(n) for n in range(1, 21)),
    "I2: an edge through a pixel": lambda: (_edge(line, shares(line)) for line in lines(20)),
    "I3: random numbers and tiles": random_numbers_and_tiles,
    "I10: random numbers just below 1": below_one,
    "I4: a million samples": lambda: [
        _sums(brightnesses(MILLION, seed=0)),
        *map(_pixels, (1, 4, 5, 63, 64, 100, 1000, 4096)),
    ],
    "I5: samples that are nearly equal": nearly_equal_samples,
}
