"""How close to a noisy reference correct pictures lie: never so close that anybody is suspected."""

from __future__ import annotations

import io
import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from PIL import Image

import renderer
from accuracy.comparison.inputs import Picture, picture_of
from renderer.images.colors import srgb_from_linear
from service.grading.likeness.closeness import BOUND, Closeness, closeness

SCENES = Path(__file__).parents[4] / "scenes"
SCENE = SCENES / "study" / "soft.json"
SIDE = 64
CORRECT = (
    ("random", 4),
    ("random", 64),
    ("stratified", 16),
    ("sobol", 16),
    ("uniform", 16),
)

pytestmark = pytest.mark.slow


def rendered(pattern: str, samples: int, seed: int) -> renderer.RenderResult:
    document: dict[str, Any] = json.loads(SCENE.read_text())
    document["camera"] |= {"width": SIDE, "height": SIDE}
    light = {"pattern": pattern, "samples": 1 if pattern != "uniform" else 4}
    document["sampling"] = {
        "antialiasing": {"pattern": pattern, "samples": samples},
        "light": light,
        "seed": seed,
    }
    return renderer.render(renderer.compile_scene(document, layers=("error", "samples")), workers=1)


def as_npy(image: np.ndarray) -> bytes:
    buffer = io.BytesIO()
    np.save(buffer, image)
    return buffer.getvalue()


def as_png(image: np.ndarray) -> bytes:
    codes = np.floor(srgb_from_linear(np.clip(image, 0, 1)) * 255 + 0.5).astype(np.uint8)
    buffer = io.BytesIO()
    Image.fromarray(codes).save(buffer, "PNG")
    return buffer.getvalue()


@pytest.fixture(scope="module")
def correct() -> dict[str, Picture]:
    """Pictures of other seeds, as floating point and as PNG."""
    forms = {"npy": as_npy, "png": as_png}
    return {
        f"{pattern} {samples} {form}": picture_of(encode(image), form)
        for pattern, samples in CORRECT
        for image in [rendered(pattern, samples, 7).image]
        for form, encode in forms.items()
    }


def noisy_reference(pattern: str) -> tuple[np.ndarray, Picture]:
    """Pixels of 16 samples, and the same as a reference that states its noise."""
    result = rendered(pattern, 16, 1)
    layers = {name: result.layers[name] for name in ("error", "samples")}
    return result.image, picture_of(as_npy(result.image), "reference", layers=layers)


def counted(image: Picture, reference: Picture) -> Closeness:
    found = closeness(image, reference)
    assert found is not None
    return found


@pytest.mark.parametrize("pattern", ["random", "stratified", "sobol"])
def test_no_correct_picture_is_suspected_and_every_copy_is(pattern: str, correct: dict[str, Picture]) -> None:
    reference = noisy_reference(pattern)[1]
    for image in correct.values():
        found = counted(image, reference)
        assert not found.suspicious
        assert found.near < BOUND * max(found.pixels, 1)


@pytest.mark.parametrize("form", [as_npy, as_png])
def test_a_copy_is_suspected_also_with_eight_bits(form: Callable[[np.ndarray], bytes]) -> None:
    pixels, reference = noisy_reference("random")
    assert counted(picture_of(form(pixels), "copy"), reference).suspicious
