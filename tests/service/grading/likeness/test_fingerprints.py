"""Pictures that share their noise, on pictures of which all is known."""

from collections.abc import Callable

import numpy as np
import pytest

from accuracy.comparison.inputs import Picture, picture_of
from service.grading.likeness.fingerprints import Fingerprint, fingerprint, like, noise_of, pairs, parts
from tests.service.grading.assignments import codes_of, npy, png

HEIGHT, WIDTH, SAMPLES, STUDENTS = 64, 96, 16, 40
CENTER, RADIUS = (40.0, 30.0), 20.0

Drawn = Callable[[np.ndarray, np.ndarray], np.ndarray]
"""The value of the scene at columns x and rows y."""


def disc(x: np.ndarray, y: np.ndarray) -> np.ndarray:
    """A bright disc before a slope."""
    inside = (x - CENTER[0]) ** 2 + (y - CENTER[1]) ** 2 < RADIUS**2
    return np.where(inside, 0.7, 0.2 + 0.1 * x / WIDTH)


MISTAKES: dict[str, Drawn] = {
    "shifted": lambda x, y: disc(x - 0.5, y - 0.5),
    "too dark": lambda x, y: 0.8 * disc(x, y),
    "without the disc": lambda x, _: 0.2 + 0.1 * x / WIDTH,
    "striped": lambda x, y: disc(x, y) + 0.1 * ((x // 3) % 2),
}


def drawn(
    seed: int, scene: Drawn = disc, samples: int = SAMPLES, places: str = "random", lamp: float = 0.1
) -> np.ndarray:
    """A picture by samples of pixels; the lower half also has the noise of a lamp, in every sample."""
    random = np.random.default_rng(seed)
    y, x = np.mgrid[:HEIGHT, :WIDTH].astype(float)
    total = np.zeros((HEIGHT, WIDTH))
    for _ in range(samples):
        a, b = random.random((2, HEIGHT, WIDTH)) if places == "random" else (0.5, 0.5)
        total += scene(x + a, y + b) * (1 + lamp * random.normal(size=x.shape) * (y >= HEIGHT // 2))
    return total / samples


def seen(pixels: np.ndarray) -> Picture:
    """A grey picture as it is read from a PNG file."""
    return picture_of(png(np.repeat(pixels[:, :, None], 3, axis=2)), "picture.png", "srgb")


@pytest.fixture(scope="module")
def reference() -> Picture:
    values = drawn(0, samples=400, lamp=0)
    grey = np.repeat(values[:, :, None], 3, axis=2).astype(np.float32)
    return picture_of(npy(grey), "reference.npy", "linear")


@pytest.fixture(scope="module")
def right(reference: Picture) -> list[Fingerprint]:
    """The right pictures of a class, each with its own noise."""
    return [fingerprint(seen(codes_of(drawn(seed))), reference) for seed in range(1, STUDENTS + 1)]


def found(prints: list[Fingerprint]) -> list[tuple[int, int]]:
    noise = noise_of(prints)
    assert noise is not None
    return sorted({(pair.first, pair.second) for part in parts(noise) for pair in pairs(part)})


def test_right_pictures_make_no_pair(right: list[Fingerprint]) -> None:
    # Eight standard errors: one failure in 10^12 classes of this size.
    assert found(right) == []


@pytest.mark.parametrize(
    "alter",
    [
        lambda pixels: pixels,
        lambda pixels: np.clip(pixels * 1.04, 0, 255).astype(np.uint8),
        lambda pixels: np.clip(pixels + np.random.default_rng(9).normal(0, 1, pixels.shape), 0, 255),
        lambda pixels: np.where(np.mgrid[:HEIGHT, :WIDTH][1] < WIDTH // 3, pixels[::-1], pixels),
    ],
    ids=["saved again", "brighter", "noisier", "a third replaced"],
)
def test_altered_copy_is_found(
    right: list[Fingerprint], reference: Picture, alter: Callable[[np.ndarray], np.ndarray]
) -> None:
    copy = fingerprint(seen(alter(codes_of(drawn(3))).astype(np.uint8)), reference)
    assert found([*right, copy]) == [(2, STUDENTS)]


def test_halves_of_two_pictures_are_found(right: list[Fingerprint], reference: Picture) -> None:
    left = np.arange(WIDTH) < WIDTH // 2
    spliced = fingerprint(seen(np.where(left, codes_of(drawn(3)), codes_of(drawn(7)))), reference)
    assert found([*right, spliced]) == [(2, STUDENTS), (6, STUDENTS)]


@pytest.mark.parametrize("scene", MISTAKES.values(), ids=MISTAKES)
def test_shared_mistake_makes_no_pair(right: list[Fingerprint], reference: Picture, scene: Drawn) -> None:
    wrong = [fingerprint(seen(codes_of(drawn(seed, scene))), reference) for seed in range(100, 106)]
    assert found([*right, *wrong]) == []


def test_one_sample_in_the_centre_makes_no_pair(right: list[Fingerprint], reference: Picture) -> None:
    jagged = [
        fingerprint(seen(codes_of(drawn(seed, samples=1, places="center", lamp=lamp))), reference)
        for seed in range(100, 103)
        for lamp in (0.0, 0.1)
    ]
    assert found([*right, *jagged]) == []


def test_picture_of_a_fixed_pattern_is_like_it(right: list[Fingerprint], reference: Picture) -> None:
    fixed = fingerprint(seen(codes_of(drawn(1000))), reference)
    noise = noise_of([*right, fixed])
    assert noise is not None
    assert np.flatnonzero(like(noise, [fixed])).tolist() == [STUDENTS]
