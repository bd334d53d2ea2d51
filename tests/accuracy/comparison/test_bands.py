"""Pictures that are compared in bands of rows, and the same pictures in one piece."""

import io
from typing import Any

import numpy as np
import pytest
from PIL import Image

from accuracy.comparison import Picture, Policy, compare, heat, picture_of
from renderer.images.colors import srgb_from_linear

HEIGHT, WIDTH, SAMPLES = 77, 61, 64
"""Neither ends with a whole block."""


def truth() -> np.ndarray:
    """Discs on a slope, no two alike, in colours of their own."""
    y, x = np.indices((HEIGHT, WIDTH))
    picture = np.stack((0.2 + 0.3 * x / WIDTH, 0.3 + 0.2 * y / HEIGHT, 0.4 - 0.2 * x / WIDTH), axis=-1)
    for down, right, radius, color in ((20, 18, 13, (0.7, 0.4, 0.2)), (52, 40, 16, (0.1, 0.3, 0.6))):
        picture[(y - down) ** 2 + (x - right) ** 2 < radius**2] = color
    return picture


def noisy(samples: int) -> np.ndarray:
    noise = np.random.default_rng(samples).normal(0, 0.2 / np.sqrt(samples), (HEIGHT, WIDTH, 3))
    return np.clip(truth() + noise, 0, 1).astype(np.float32)


def reference() -> Picture:
    layers = {
        "error": np.full((HEIGHT, WIDTH, 3), 0.2 / np.sqrt(SAMPLES)),
        "samples": np.full((HEIGHT, WIDTH), SAMPLES),
        "shape": np.indices((HEIGHT, WIDTH))[0] // 9,
    }
    return read(noisy(SAMPLES), layers)


def read(values: np.ndarray, layers: dict[str, Any] | None = None) -> Picture:
    content = io.BytesIO()
    if values.dtype == np.uint8:
        Image.fromarray(values).save(content, "PNG")
    else:
        np.save(content, values)
    return picture_of(content.getvalue(), "picture", None, layers)


def codes(linear: np.ndarray) -> np.ndarray:
    return np.rint(255 * srgb_from_linear(linear)).astype(np.uint8)


PICTURES = {
    "honest": noisy(16),
    "honest codes": codes(noisy(16)),
    "fewer samples": noisy(1),
    "upside down": noisy(16)[::-1],
    "channels": codes(noisy(16))[:, :, ::-1],
    "dark": 0.7 * noisy(16),
    "half a pixel": (noisy(16) + np.roll(noisy(16), 1, axis=0)) / 2,
    "blurred": sum(np.roll(noisy(SAMPLES), step, axis=0) for step in range(-2, 3)) / 5,
    "wrong box": np.where(np.indices((HEIGHT, WIDTH, 3))[0] < 12, 0.9, noisy(16)),
}


@pytest.mark.parametrize(
    "policy", [Policy(), Policy(samples=4, tolerance=0.002)], ids=["any noise", "bounded"]
)
@pytest.mark.parametrize("name", PICTURES)
def test_bands_say_the_same_as_one_piece(name: str, policy: Policy, monkeypatch: pytest.MonkeyPatch) -> None:
    found = []
    for pixels in (HEIGHT * WIDTH, 8 * WIDTH, 24 * WIDTH):
        monkeypatch.setattr("accuracy.comparison.pixels.AT_ONCE", pixels)
        comparison = compare(read(PICTURES[name]), reference(), policy=policy)
        drawn = heat.encoded(heat.side_by_side, comparison.image, comparison.reference)
        codes = np.asarray(Image.open(io.BytesIO(drawn))).tolist()
        found.append((numbers_apart(comparison.document()), codes))
    for (words, numbers), drawn in found[1:]:
        assert (words, drawn) == (found[0][0][0], found[0][1])
        assert numbers == pytest.approx(found[0][0][1], rel=1e-9, abs=1e-12)


def numbers_apart(document: Any) -> tuple[list[Any], list[float]]:
    """Fields that must be equal, and those that are summed in another order."""
    words, numbers = list[Any](), list[float]()
    left = [document]
    while left:
        one = left.pop()
        if isinstance(one, dict | list):
            left += one.values() if isinstance(one, dict) else one
        else:
            (numbers if isinstance(one, float) else words).append(one)
    return words, numbers
