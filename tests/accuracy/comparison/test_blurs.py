"""Blurs are found by their effect on edges, and noise is no blur."""

from dataclasses import replace

import numpy as np
import pytest

from accuracy.comparison import Picture
from accuracy.comparison.asserting import compared
from accuracy.comparison.blurs import blur, smoothed

SIDE = 64
picture = Picture.of_values


def discs(finer: int = 8) -> np.ndarray:
    """Bright discs on a dark ground; each pixel is the mean of finer x finer points of its square."""
    y, x = (np.indices((SIDE * finer, SIDE * finer)) + 0.5) / finer
    inside = np.zeros(x.shape, dtype=bool)
    for middle in ((14.3, 17.2, 9.1), (41.7, 12.6, 7.4), (22.9, 45.3, 12.7), (50.2, 44.1, 6.3)):
        inside |= (x - middle[0]) ** 2 + (y - middle[1]) ** 2 < middle[2] ** 2
    shares = inside.reshape(SIDE, finer, SIDE, finer).mean(axis=(1, 3))
    return 0.1 + shares[:, :, None] * np.array([0.7, 0.5, 0.3])


def noisy(seed: int, samples: int) -> np.ndarray:
    """So many random samples in each pixel."""
    shares = (discs()[:, :, 0] - 0.1) / 0.7
    drawn = np.random.default_rng(seed).binomial(samples, np.clip(shares, 0, 1)) / samples
    return 0.1 + drawn[:, :, None] * np.array([0.7, 0.5, 0.3])


def errors(samples: int) -> np.ndarray:
    shares = (discs()[:, :, 0] - 0.1) / 0.7
    deviation = np.sqrt(np.clip(shares * (1 - shares), 0, 1) / samples)
    return deviation[:, :, None] * np.array([0.7, 0.5, 0.3])


@pytest.mark.parametrize("width", [0.8, 1.0, 2.0])
@pytest.mark.parametrize("points", [1, 8])
def test_blur_is_named_with_its_width(width: float, points: int) -> None:
    """With one point in the middle of each pixel too: a blur is no anti-aliasing."""
    image = smoothed(discs(points), width)
    found = compared(image, discs())
    assert found.judgement.verdict == "mismatch"
    assert found.causes[0].cause == "blurred"
    named = blur(picture(image), picture(discs()))
    assert named is not None
    assert named.width == pytest.approx(width, rel=0.26)


@pytest.mark.parametrize("samples", [4, 16, 64])
def test_noise_is_no_blur(samples: int) -> None:
    """Each has a probability of 3e-7, also where the reference is the noisier one."""
    for seed in range(5):
        image, reference = picture(noisy(seed, samples)), picture(noisy(100 + seed, 4))
        stated = replace(reference, layers={"error": errors(4), "samples": np.full((SIDE, SIDE), 4)})
        assert blur(image, picture(discs())) is None
        for each in (reference, stated):
            assert blur(image, each) is None
            assert blur(picture(discs()), each) is None


def test_filter_of_renderers_is_no_blur() -> None:
    """A tent 2 pixels wide, the pixel's square spread over another one: 1/12 of variance along each axis."""
    weights = np.array([1, 22, 1]) / 24
    rows = sum(w * np.roll(discs(), step, 0) for w, step in zip(weights, (-1, 0, 1), strict=True))
    tent = sum(w * np.roll(rows, step, 1) for w, step in zip(weights, (-1, 0, 1), strict=True))
    assert blur(picture(tent), picture(discs())) is None
