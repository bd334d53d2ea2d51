"""Two independent halves of samples, each well spread by itself."""

import math
from collections.abc import Callable

import numpy as np
import pytest
from numpy.typing import NDArray

import renderer
from renderer.halves import SequenceEmitter, places
from renderer.lights import emitters
from schemas.lights import ParallelogramLight
from schemas.quality import LightSampling, TargetQuality
from tests.documents import camera, lamp, scene

Numbers = NDArray[np.float64]
LIGHT = ParallelogramLight.model_validate(lamp([1, 2, 3], [2, 0, 1], [0, 3, 1]))
PIXELS = 4000


def numbers(first: int, last: int, half: int) -> NDArray[np.int64]:
    """Samples of a half: the halves take turns."""
    return 2 * np.arange(first, last) + half


def emitter(number: int = 0, count: int = 4, seed: int = 3) -> SequenceEmitter:
    sampling = LightSampling(pattern="sobol", samples=count)
    return SequenceEmitter.of(emitters.build_rectangle(number, LIGHT, sampling, seed))


def on_light(light: SequenceEmitter, pixels: Numbers, samples: Numbers) -> Numbers:
    """Light points (2, count, samples)."""
    points = light.points(pixels, samples, np.zeros(samples.size, np.uint64), np.dtype(np.float64))
    return np.array(points.places(np.arange(samples.size)))


def is_net(points: Numbers) -> bool:
    """Whether each of the n = 2**m boxes of area 1 / n, whatever its shape, holds one of the n points."""
    x, y = points
    power = x.size.bit_length() - 1
    assert x.size == 1 << power
    return all(
        sorted(np.floor(x * 2**k) + 2**k * np.floor(y * 2 ** (power - k))) == list(range(x.size))
        for k in range(power + 1)
    )


@pytest.mark.parametrize("half", [0, 1])
@pytest.mark.parametrize("pixel", [0, 1, 262143])
@pytest.mark.parametrize("power", range(9))
def test_half_is_a_net_in_the_pixel(half: int, pixel: int, power: int) -> None:
    """Its first samples, and as many that the next pass adds."""
    size = 1 << power
    for first in (0, size):
        samples = numbers(first, first + size, half)
        assert is_net(np.array(places(3, np.full(size, pixel), samples)))


@pytest.mark.parametrize("half", [0, 1])
@pytest.mark.parametrize("count", [2, 4, 16])
@pytest.mark.parametrize("power", range(5))
def test_half_is_a_net_on_the_light(half: int, count: int, power: int) -> None:
    """All points together, and those of each sample by themselves."""
    size = 1 << power
    points = on_light(emitter(count=count), np.full(size, 5), numbers(0, size, half)) + 0.5
    assert is_net(points.transpose(0, 2, 1).reshape(2, -1))
    assert all(is_net(points[..., sample]) for sample in range(size))


def test_sample_does_not_depend_on_its_neighbours() -> None:
    pixels, samples = np.random.default_rng(1).integers(0, 1000, (2, 50))
    together, points = np.array(places(3, pixels, samples)), on_light(emitter(), pixels, samples)
    for i in (0, 7, 49):
        one = np.s_[i : i + 1]
        assert (np.array(places(3, pixels[one], samples[one])) == together[:, one]).all()
        assert (on_light(emitter(), pixels[one], samples[one]) == points[..., one]).all()


def correlation(a: Numbers, b: Numbers) -> float:
    """In standard deviations of that of independent numbers."""
    a, b = a - a.mean(), b - b.mean()
    return float((a * b).sum() / np.sqrt((a * a).sum() * (b * b).sum())) * math.sqrt(a.size)


def per_pixel(seed: int = 3) -> dict[str, Numbers]:
    """First places of both halves of many pixels, in the pixel and on two lights, a coordinate each."""
    pixels, found = np.arange(PIXELS), {}
    for half in (0, 1):
        samples = np.full(PIXELS, half)
        for axis, place in enumerate(places(seed, pixels, samples)):
            found[f"pixel {half} {axis}"] = place
        for number in (0, 1):
            for axis, point in enumerate(on_light(emitter(number, seed=seed), pixels, samples)):
                found[f"light {number} {half} {axis}"] = point[0]
    return found


def test_halves_lights_and_seeds_are_independent() -> None:
    """66 pairs within a seed and 12 between two: one in 20,000 such tests has one beyond 5 deviations."""
    known, other = per_pixel(), per_pixel(seed=4)
    names = list(known)
    for i, a in enumerate(names):
        for b in names[:i]:
            assert abs(correlation(known[a], known[b])) < 5, (a, b)
        assert abs(correlation(known[a], other[a])) < 5, a


def lens_places(pixels: Numbers, samples: Numbers) -> tuple[Numbers, Numbers]:
    document = scene(camera=camera(lens_radius=0.5))
    lens = renderer.compile_scene(document, TargetQuality(mode="target", error=0.01)).camera
    x, y = lens.places(pixels, samples)  # type: ignore[attr-defined]
    return x, y


@pytest.mark.parametrize("samples", [2, 4, 16])
@pytest.mark.parametrize("place", [lambda *each: places(3, *each), lens_places], ids=["pixel", "lens"])
def test_halves_have_independent_means(place: Callable[..., tuple[Numbers, Numbers]], samples: int) -> None:
    """Of an edge, a product and a wave, over many pixels: their errors correlate within 5 deviations."""

    def means(half: int) -> list[Numbers]:
        x, y = place(np.arange(PIXELS).repeat(samples), np.tile(numbers(0, samples, half), PIXELS))
        values = (x + 0.3 * y < 0.45) / 1.0, x * y, np.sin(9 * x + 5 * y)
        return [value.reshape(PIXELS, samples).mean(axis=1) for value in values]

    for a, b in zip(means(0), means(1), strict=True):
        assert abs(correlation(a, b)) < 5


def test_pixel_and_light_places_are_independent() -> None:
    """Over the samples of a half, not only between pixels: 16 samples of 1000 pixels."""
    pixels, samples = np.arange(1000).repeat(16), np.tile(numbers(0, 16, 0), 1000)
    for point in on_light(emitter(count=2), pixels, samples).reshape(4, -1):
        for place in places(3, pixels, samples):
            assert abs(correlation(place, point)) < 5
