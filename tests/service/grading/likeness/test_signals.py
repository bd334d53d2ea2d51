"""Signals of a test: copies of the reference are signalled to staff, and cost no points."""

import numpy as np
import pytest
from PIL import Image

from accuracy.comparison import Comparison, compare
from service.grading.likeness.signals import signals
from tests.service.grading.assignments import (
    SCENE,
    Assignment,
    codes_of,
    image_test,
    pixels,
    scene,
    scene_test,
)
from tests.service.grading.likeness.test_closeness import NOISE, SAMPLES, noisy, picture


def compared(image: np.ndarray, reference: np.ndarray) -> Comparison:
    return compare(picture(image), picture(reference, NOISE))


def test_independent_picture_gives_no_signal() -> None:
    assert signals(compared(noisy(1), noisy(2)), test="soft") == ()


@pytest.fixture
def noisy_assignment(assignment: Assignment) -> Assignment:
    """An assignment whose noisy reference has noise layers."""
    values = np.repeat(noisy(1)[:, :, None], 3, axis=2).astype(np.float32)
    folder = assignment.references
    np.save(folder / "reference.npy", values)
    np.save(folder / "reference.npy.error.npy", np.full_like(values, NOISE))
    np.save(folder / "reference.npy.samples.npy", np.full(values.shape[:2], SAMPLES))
    return assignment


TEST = image_test(reference={"type": "picture", "file": "reference.npy", "encoding": "linear"})


@pytest.mark.slow
def test_reference_itself_is_signalled_and_earns_all(noisy_assignment: Assignment) -> None:
    noisy_assignment.hand_in("picture.npy", (noisy_assignment.references / "reference.npy").read_bytes())
    found = noisy_assignment.grade(TEST)
    assert [signal.code for signal in found.signals] == ["identical_bytes"]
    assert (found.score, found.tests[0].status) == (10, "passed")


def test_changed_copy_is_signalled_and_earns_all(noisy_assignment: Assignment) -> None:
    values = np.load(noisy_assignment.references / "reference.npy")
    board = np.indices(values.shape).sum(axis=0) % 2 - 0.5
    noisy_assignment.hand_in("picture.npy", values + board * NOISE / 4)
    found = noisy_assignment.grade(TEST)
    assert [(signal.test, signal.code) for signal in found.signals] == [("picture", "closer_than_noise")]
    assert found.score == 10
    assert found.signals[0].message not in found.model_dump_json(include={"tests"})


def board(picture: str) -> dict[str, object]:
    """A scene of one rectangle, which fills the view with a picture."""
    material = {"type": "phong", "color_texture": "picture", "ambient": 1, "diffuse": 0}
    square = {
        "type": "rectangle",
        "center": [0, 1, 0],
        "normal": [0, 0, 1],
        "tangent": [1, 0, 0],
        "size": [9, 6],
    }
    return scene(
        textures={"picture": {"type": "image", "asset": picture}},
        materials={"board": material},
        shapes=[square | {"name": "board", "material": "board"}],
        lights=[],
    )


@pytest.mark.parametrize("flip", [1, -1])
def test_scene_that_carries_the_reference_is_signalled(assignment: Assignment, flip: int) -> None:
    codes = codes_of(pixels(SCENE))
    Image.fromarray(codes[:, ::flip]).resize((96, 64)).save(assignment.submission / "picture.png")
    assignment.hand_in("scene.json", board("picture.png"))
    assert [signal.code for signal in assignment.grade(scene_test()).signals] == ["reference_in_texture"]


def test_scene_with_a_texture_of_its_own_is_not_signalled(assignment: Assignment) -> None:
    ramp = np.linspace(0, 255, 96).astype(np.uint8)[None].repeat(64, axis=0)
    Image.fromarray(ramp).save(assignment.submission / "picture.png")
    assignment.hand_in("scene.json", board("picture.png"))
    assert assignment.grade(scene_test()).signals == ()
