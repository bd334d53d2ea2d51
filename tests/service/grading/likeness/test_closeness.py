"""Pixels that share the noise of a reference: correct pictures are never suspected, copies always."""

import math
from collections.abc import Callable
from pathlib import Path
from statistics import NormalDist

import numpy as np
import pytest

import renderer
from accuracy.comparison.inputs import Picture, picture_of
from service.grading.likeness.closeness import Closeness, closeness
from tests.service.grading.assignments import codes_of, npy, png

SIDE, TRUTH, NOISE, SAMPLES = 96, 0.3, 0.05, 64
NEAR, BOUND, LEVEL, FEWEST = 0.25, 0.7, 1e-6, 16
"""As docs/how-to/grading.md states them."""

ALL = 0.95 * SIDE * SIDE

Made = Callable[[np.ndarray], Picture]


def picture(values: np.ndarray, error: float | np.ndarray | None = None, samples: int = SAMPLES) -> Picture:
    """A floating-point picture of values (H, W), grey, with what it states of its noise."""
    shape = (*values.shape, 3)
    layers = {}
    if error is not None:
        layers["error"] = np.broadcast_to(np.asarray(error)[..., None], shape).astype(np.float32)
        layers["samples"] = np.full(values.shape, samples)
    grey = np.broadcast_to(values[:, :, None], shape).astype(np.float32)
    return picture_of(npy(grey), "picture.npy", "linear", layers)


def eight_bits(values: np.ndarray) -> Picture:
    codes = np.rint(np.clip(values, 0, 1) * 255).astype(np.uint8)
    return picture_of(png(np.repeat(codes[:, :, None], 3, axis=2)), "picture.png", "linear")


def noisy(seed: int, deviation: float = NOISE) -> np.ndarray:
    return np.random.default_rng(seed).normal(TRUTH, deviation, (SIDE, SIDE))


def counted(image: Picture, reference: Picture) -> Closeness:
    found = closeness(image, reference)
    assert found is not None
    return found


def is_share(found: Closeness, share: float) -> bool:
    """Six deviations of a binomial count: one failure in 10^9 seeds."""
    return abs(found.near - share * found.pixels) < 6 * math.sqrt(found.pixels * share * (1 - share))


def test_flawless_picture_is_near_as_often_as_stated() -> None:
    found = counted(picture(np.full((SIDE, SIDE), TRUTH)), picture(noisy(1), NOISE))
    assert found.pixels > ALL
    assert is_share(found, 2 * NormalDist().cdf(NEAR) - 1)
    assert not found.suspicious


@pytest.mark.parametrize("made", [picture, eight_bits])
def test_copy_is_near_everywhere(made: Made) -> None:
    found = counted(made(noisy(2)), picture(noisy(2), NOISE))
    assert found.near == found.pixels > ALL
    assert found.suspicious


def test_own_noise_clears_a_picture() -> None:
    reference = picture(noisy(3), NOISE)
    assert not counted(picture(noisy(4)), reference).suspicious
    assert not counted(picture(noisy(5, 4 * NOISE)), reference).suspicious


def test_false_alarm_is_rarer_than_stated() -> None:
    suspicious = [Closeness(1000, near).suspicious for near in range(1001)]
    first = suspicious.index(True)
    assert all(suspicious[first:])
    # The exact tail of the binomial is below Chernoff's bound.
    tail = sum(math.comb(1000, k) * 0.7**k * 0.3 ** (1000 - k) for k in range(first, 1001))
    assert LEVEL / 1000 < tail <= LEVEL


def test_noise_is_that_of_the_reference_alone() -> None:
    values = noisy(11)
    assert counted(picture(values, 100.0), picture(values, NOISE)).suspicious
    assert closeness(picture(values), picture(values)) is None


def rendered(pattern: str, samples: int, seed: int) -> renderer.RenderResult:
    scene = renderer.load_scene(Path(__file__).parents[4] / "scenes" / "study" / "soft.json")
    document = scene.document.model_dump(mode="json", exclude_unset=True)
    document["camera"] |= {"width": 64, "height": 64}
    light = {"pattern": pattern, "samples": 1 if pattern != "uniform" else 4}
    antialiasing = {"pattern": pattern, "samples": samples}
    document["sampling"] = {"antialiasing": antialiasing, "light": light, "seed": seed}
    return renderer.render(renderer.compile_scene(document, layers=("error", "samples")), workers=1)


def forms(image: np.ndarray) -> tuple[Picture, Picture]:
    """As floating point and as PNG."""
    return picture_of(npy(image), "npy"), picture_of(png(codes_of(image)), "png")


@pytest.mark.slow
def test_rendered_picture_is_not_suspected_and_its_copy_is() -> None:
    patterns = (("random", 4), ("random", 64), ("stratified", 16), ("sobol", 16), ("uniform", 16))
    correct = [image for pattern in patterns for image in forms(rendered(*pattern, 7).image)]
    for pattern in ("random", "stratified", "sobol"):
        result = rendered(pattern, 16, 1)
        layers = {name: result.layers[name] for name in ("error", "samples")}
        reference = picture_of(npy(result.image), "reference", layers=layers)
        for image in correct:
            found = counted(image, reference)
            assert not found.suspicious
            assert found.near < BOUND * max(found.pixels, 1)
        assert pattern != "random" or all(counted(copy, reference).suspicious for copy in forms(result.image))
