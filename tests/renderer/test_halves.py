"""Where the samples of either half lie: well spread each by itself, and the halves unknown to each other."""

import math

import numpy as np
import pytest
from numpy.typing import NDArray

import renderer
from accuracy.hard_cases.documents import camera, lamp, scene
from renderer.halves import HALVES, SequenceEmitter, in_sequence, places
from renderer.lights import emitters
from schemas.lights import ParallelogramLight
from schemas.quality import LightSampling, TargetQuality

Numbers = NDArray[np.float64]
LIGHT = ParallelogramLight.model_validate(lamp([1, 2, 3], [2, 0, 1], [0, 3, 1]))


def in_pixel(pixel: int, half: int, first: int, last: int, seed: int = 3) -> Numbers:
    """Places (2, n) of the samples first..last of a half."""
    samples = np.arange(first, last) * HALVES + half
    return np.array(places(seed, np.full(samples.size, pixel), samples))


def emitter(number: int = 0, count: int = 4, seed: int = 3) -> SequenceEmitter:
    sampling = LightSampling(pattern="sobol", samples=count)
    return in_sequence(emitters.build_rectangle(number, LIGHT, sampling, seed))


def on_light(light: SequenceEmitter, pixel: int, half: int, samples: int, path: int = 0) -> Numbers:
    """Light points (2, samples * count) of a half's first samples, those of a sample together."""
    numbers = np.arange(samples) * HALVES + half
    pixels, paths = np.full(samples, pixel), np.full(samples, path, np.uint64)
    points = light.points(pixels, numbers, paths, np.dtype(np.float64))
    u, v = points.places(np.arange(samples))
    return np.array([u.T.ravel(), v.T.ravel()]) + 0.5


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
def test_first_samples_are_a_net(half: int, pixel: int, power: int) -> None:
    assert is_net(in_pixel(pixel, half, 0, 1 << power))


@pytest.mark.parametrize("half", [0, 1])
@pytest.mark.parametrize("count", [2, 4, 16])
@pytest.mark.parametrize("power", range(7))
def test_light_points_are_a_net(half: int, count: int, power: int) -> None:
    """All of them together, and those of each sample by themselves."""
    points = on_light(emitter(count=count), 5, half, 1 << power)
    assert is_net(points)
    for sample in range(1 << power):
        assert is_net(points[:, sample * count : (sample + 1) * count])


@pytest.mark.parametrize("path", [0, 12345678901234567890])
def test_light_points_never_repeat(path: int) -> None:
    points = np.concatenate([on_light(emitter(), 5, half, 256, path) for half in (0, 1)], axis=1)
    assert np.unique(points, axis=1).shape[1] == 2 * 256 * 4


def test_sample_is_free_of_its_batch() -> None:
    pixels, samples = np.random.default_rng(1).integers(0, 1000, (2, 50))
    together = np.array(places(3, pixels, samples))
    light, paths = emitter(), np.zeros(50, np.uint64)
    points = light.points(pixels, samples, paths, np.dtype(np.float64)).places(np.arange(50))
    for i in (0, 7, 49):
        one = np.s_[i : i + 1]
        assert (np.array(places(3, pixels[one], samples[one])) == together[:, one]).all()
        alone = light.points(pixels[one], samples[one], paths[one], np.dtype(np.float64))
        assert (np.array(alone.places(np.arange(1))) == np.array(points)[:, :, one]).all()


def correlation(a: Numbers, b: Numbers) -> float:
    """In standard deviations of that of independent numbers."""
    a, b = a - a.mean(), b - b.mean()
    return float((a * b).sum() / np.sqrt((a * a).sum() * (b * b).sum())) * math.sqrt(a.size)


PIXELS = 4000


def per_pixel(seed: int = 3) -> dict[str, Numbers]:
    """First places of both halves of many pixels, in the pixel and on two lights, a coordinate each."""
    pixels, paths = np.arange(PIXELS), np.zeros(PIXELS, np.uint64)
    found = {}
    for half in (0, 1):
        samples = np.full(PIXELS, half)
        for axis, place in enumerate(places(seed, pixels, samples)):
            found[f"pixel {half} {axis}"] = place
        for number in (0, 1):
            light = emitter(number, seed=seed)
            points = light.points(pixels, samples, paths, np.dtype(np.float64)).places(np.arange(PIXELS))
            for axis, place in enumerate(points):
                found[f"light {number} {half} {axis}"] = place[0]
    return found


def test_halves_are_uncorrelated() -> None:
    """66 pairs within a seed and 12 between two: one in 20,000 such tests has one beyond 5 deviations."""
    known, other = per_pixel(), per_pixel(seed=4)
    names = list(known)
    for i, a in enumerate(names):
        for b in names[:i]:
            assert abs(correlation(known[a], known[b])) < 5, (a, b)
        assert abs(correlation(known[a], other[a])) < 5, a


@pytest.mark.parametrize("samples", [2, 4, 16])
def test_means_of_halves_are_independent(samples: int) -> None:
    """Of an edge, a product and a wave, over many pixels: their errors correlate within 5 deviations."""
    pixels = np.arange(PIXELS).repeat(samples)

    def errors(half: int) -> list[Numbers]:
        numbers = np.tile(np.arange(samples), PIXELS) * HALVES + half
        x, y = places(3, pixels, numbers)
        values = (x + 0.3 * y < 0.55) / 1.0, x * y, np.sin(9 * x + 5 * y)
        return [value.reshape(PIXELS, samples).mean(axis=1) for value in values]

    for a, b in zip(errors(0), errors(1), strict=True):
        assert abs(correlation(a, b)) < 5


@pytest.mark.parametrize("samples", [2, 4, 16])
def test_halves_of_a_lens_are_independent(samples: int) -> None:
    document = scene(camera=camera(lens_radius=0.5))
    lens = renderer.compile_scene(document, TargetQuality(mode="target", error=0.01)).camera
    pixels = np.arange(PIXELS).repeat(samples)

    def errors(half: int) -> list[Numbers]:
        numbers = np.tile(np.arange(samples), PIXELS) * HALVES + half
        a, b = lens.places(pixels, numbers)  # type: ignore[attr-defined]
        values = (a + 0.3 * b < 0.2) / 1.0, a * b, np.sin(3 * a + b)
        return [value.reshape(PIXELS, samples).mean(axis=1) for value in values]

    for a, b in zip(errors(0), errors(1), strict=True):
        assert abs(correlation(a, b)) < 5


def test_pixel_and_light_are_uncorrelated() -> None:
    """Over the samples of a half, not only between pixels: 16 samples of 1000 pixels, within 5 deviations."""
    pixels, samples = np.arange(1000).repeat(16), np.tile(np.arange(16) * HALVES, 1000)
    paths = np.zeros(16000, np.uint64)
    x, y = places(3, pixels, samples)
    u, v = emitter(count=2).points(pixels, samples, paths, np.dtype(np.float64)).places(np.arange(16000))
    for place in (x, y):
        for point in (*u, *v):
            assert abs(correlation(place, point)) < 5
