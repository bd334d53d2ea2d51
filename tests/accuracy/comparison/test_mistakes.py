"""Mistakes made with real pictures of a small scene are named, and correct pictures are not."""

import io
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

import renderer
from accuracy.comparison import Comparison, compare, picture_of
from accuracy.comparison.mistakes import moved
from accuracy.comparison.shown import names_of, shapes_shown
from renderer.images.colors import linear_from_srgb, srgb_from_linear

SIDE = 96
Change = Callable[[np.ndarray], np.ndarray]


def scene(samples: int, pattern: str, **changes: Any) -> dict[str, Any]:
    """A green ball and a red wall on a floor: no two sides are alike, and nothing is white."""
    material = {"type": "phong", "ambient": 0.1, "diffuse": 0.9, "specular": 0.1, "shininess": 20}
    side = {"type": "rectangle", "normal": [0, 0, 1], "tangent": [1, 0, 0]}
    document = {
        "version": 1,
        "camera": {
            "position": [0.5, 2, 6],
            "look_at": [0, 0.7, 0],
            "vertical_fov": 42,
            "width": SIDE,
            "height": SIDE,
        },
        "background": [0.05, 0.08, 0.2],
        "ambient": [1, 1, 1],
        "materials": {
            "floor": material | {"color": [0.7, 0.65, 0.6]},
            "ball": material | {"color": [0.15, 0.6, 0.2]},
            "block": material | {"color": [0.7, 0.15, 0.1]},
        },
        "shapes": [
            {
                "type": "rectangle",
                "center": [0, 0, 0],
                "normal": [0, 1, 0],
                "tangent": [1, 0, 0],
                "size": [7, 5],
                "material": "floor",
            },
            {
                "type": "ellipsoid",
                "name": "ball",
                "center": [-0.9, 0.8, 0],
                "radius": 0.8,
                "material": "ball",
            },
            side | {"center": [1.2, 0.9, -0.5], "size": [1.3, 1.8], "material": "block"},
        ],
        "lights": [
            {
                "type": "rectangle",
                "center": [2, 4, 2],
                "normal": [-0.5, -1, -0.5],
                "tangent": [1, 0, -1],
                "size": [1.5, 1.5],
                "color": [0.8, 0.8, 0.8],
            }
        ],
        "sampling": {
            "antialiasing": {"pattern": pattern, "samples": samples},
            "light": {"pattern": "random" if pattern == "random" else "uniform", "samples": 16},
            "seed": 3,
        },
    }
    return document | changes


def pixels(document: dict[str, Any]) -> np.ndarray:
    return renderer.render(renderer.compile_scene(document)).image


def read(image: np.ndarray) -> Any:
    file = io.BytesIO()
    np.save(file, image.astype(np.float32))
    return picture_of(file.getvalue(), "picture.npy")


@pytest.fixture(scope="module")
def reference() -> np.ndarray:
    return pixels(scene(144, "uniform"))


@pytest.fixture(scope="module", params=["uniform", "random"])
def correct(request: pytest.FixtureRequest) -> np.ndarray:
    return pixels(scene(16, request.param))


def against(reference: np.ndarray, image: np.ndarray, **options: Any) -> Comparison:
    return compare(read(image), read(reference), **options)


def shifted(right: int, down: int) -> Change:
    return lambda image: moved(image, right, down)


def aces(x: np.ndarray) -> np.ndarray:
    return np.asarray(x * (2.51 * x + 0.03) / (x * (2.43 * x + 0.59) + 0.14))


MISTAKES: list[tuple[str, Change]] = [
    ("flipped_vertically", lambda image: image[::-1]),
    ("flipped_horizontally", lambda image: image[:, ::-1]),
    ("turned_half", lambda image: image[::-1, ::-1]),
    ("transposed", lambda image: image.transpose(1, 0, 2)),
    ("channels_bgr", lambda image: image[:, :, [2, 1, 0]]),
    ("channels_grb", lambda image: image[:, :, [1, 0, 2]]),
    ("channels_rbg", lambda image: image[:, :, [0, 2, 1]]),
    ("channels_gbr", lambda image: image[:, :, [1, 2, 0]]),
    ("channels_brg", lambda image: image[:, :, [2, 0, 1]]),
    ("gamma_missing", linear_from_srgb),
    ("gamma_twice", srgb_from_linear),
    ("tone_mapped_reinhard", lambda image: image / (1 + image)),
    ("tone_mapped_luminance", lambda image: image / (1 + image @ [0.2126, 0.7152, 0.0722])[..., None]),
    ("tone_mapped_exponential", lambda image: 1 - np.exp(-image)),
    ("tone_mapped_aces", aces),
    ("exposure", lambda image: image * 1.1),
    ("exposure", lambda image: image * 0.5),
    ("exposure", lambda image: image * 2),
    ("one_pixel_right", shifted(1, 0)),
    ("one_pixel_left", shifted(-1, 0)),
    ("one_pixel_down", shifted(0, 1)),
    ("one_pixel_up", shifted(0, -1)),
    ("one_pixel_left_down", shifted(-1, 1)),
]


@pytest.mark.parametrize(("cause", "change"), MISTAKES, ids=[cause for cause, _ in MISTAKES])
def test_mistake_is_named_first(
    reference: np.ndarray, correct: np.ndarray, cause: str, change: Change
) -> None:
    found = against(reference, np.clip(change(correct), 0, 1))
    assert found.judgement.verdict == "mismatch"
    assert found.causes[0].cause == cause
    assert found.causes[0].rmse_after < found.causes[0].rmse_before


def test_power_of_2_2_for_srgb(reference: np.ndarray) -> None:
    """The two differ by less than 0.01."""
    found = against(reference, linear_from_srgb(reference ** (1 / 2.2)))
    assert found.causes[0].cause == "gamma_2.2"
    assert found.judgement.verdict == "mismatch"


def test_camera_half_a_pixel_aside(reference: np.ndarray) -> None:
    """Each row of 192 columns begins one column late: half a pixel of the picture that is made of them."""
    document = scene(36, "uniform")
    document["camera"] |= {"width": 2 * SIDE, "height": 2 * SIDE}
    late = moved(pixels(document), 1, 0)
    halved = late.reshape(SIDE, 2, SIDE, 2, 3).mean(axis=(1, 3))
    assert against(reference, halved).causes[0].cause == "half_pixel_right"


def test_missing_anti_aliasing(reference: np.ndarray) -> None:
    found = against(reference, pixels(scene(1, "center")))
    assert [cause.cause for cause in found.causes] == ["antialiasing_missing"]
    assert found.judgement.verdict == "mismatch"


@pytest.mark.parametrize(
    ("pattern", "samples"), [("uniform", 4), ("uniform", 64), ("random", 4), ("sobol", 16)]
)
def test_correct_picture_has_no_cause(reference: np.ndarray, pattern: str, samples: int) -> None:
    found = against(reference, pixels(scene(samples, pattern)))
    assert found.judgement.verdict == "noisy_match"
    assert found.causes == ()


def test_picture_of_eight_bits(correct: np.ndarray) -> None:
    codes = np.floor(srgb_from_linear(np.clip(correct, 0, 1)) * 255 + 0.5).astype(np.uint8)
    file = io.BytesIO()
    np.save(file, codes)
    found = compare(picture_of(file.getvalue(), "codes.npy", "srgb"), read(correct))
    assert found.judgement.verdict == "match"
    assert found.regions == ()


def test_missing_shape(reference: np.ndarray) -> None:
    document = scene(16, "uniform")
    whole = renderer.load_scene(document)
    without = pixels(document | {"shapes": [document["shapes"][0], document["shapes"][2]]})
    found = against(reference, without, shapes=shapes_shown(whole), names=names_of(whole.document))
    verdict = found.document()
    assert verdict["verdict"] == "mismatch"
    assert verdict["diagnosis"] == []
    assert verdict["worst_regions"][0]["name"] == "ball (shapes/1)"


def test_missing_shadow(reference: np.ndarray) -> None:
    """The ball floats in the air beside the light: seen where it was, its shadow on the floor is gone."""
    document = scene(16, "uniform")
    whole = renderer.load_scene(document)
    lit = dict(document["lights"][0])
    small = renderer.render(
        renderer.compile_scene(document | {"lights": [lit | {"center": [0.5, 2, 6]}]})
    ).image
    found = against(reference, small, shapes=shapes_shown(whole), names=names_of(whole.document))
    assert found.judgement.verdict == "mismatch"
    names = {region["name"] for region in found.document()["worst_regions"]}
    assert "rectangle (shapes/0)" in names
