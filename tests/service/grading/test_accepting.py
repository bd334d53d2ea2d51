"""Noise in graded pictures: bounded where the reference states its own, signalled where it is implausible."""

import numpy as np
import pytest

from tests.service.grading.assignments import SCENE, Assignment, image_test, pixels
from tests.service.grading.likeness import test_sample_counts as striped

FILE = "reference.npz"
RIGHT = pixels(SCENE)
BAND = {"at": 0.5, "share": 0.5}


def noise_test(**accept: object) -> dict[str, object]:
    return image_test(
        reference={"type": "picture", "file": FILE, "encoding": "linear"},
        accept={"by": "verdict", "tolerance": 0.005, **accept},
    )


@pytest.fixture
def stripes(assignment: Assignment) -> Assignment:
    """An assignment whose reference states its noise in one file."""
    known = striped.reference()
    np.savez(assignment.references / FILE, image=known.linear, **known.layers)
    return assignment


def drawn(samples: int, seed: int, brighter: float = 0.0) -> np.ndarray:
    return striped.honest(samples, seed).linear + brighter


def noisy(picture: np.ndarray, deviation: float) -> np.ndarray:
    return picture + np.random.default_rng(3).normal(0, deviation, picture.shape)


def test_noise_beyond_the_fewest_samples_is_not_accepted(stripes: Assignment) -> None:
    stripes.hand_in("picture.npy", noisy(drawn(16, 1), 0.1))
    tested = stripes.test(noise_test(samples=4))
    assert (tested.points, tested.metric) == (0, "noisy_blocks")
    assert stripes.test(noise_test(samples="any")).points == 10
    # One sample is what is bounded by default.
    stripes.hand_in("picture.npy", noisy(drawn(16, 1), 0.5))
    assert stripes.test(noise_test()).points == 0
    stripes.hand_in("picture.npy", drawn(1, 1))
    assert stripes.test(noise_test()).points == 10


def test_noise_is_not_bounded_by_a_reference_that_does_not_state_its_own(assignment: Assignment) -> None:
    assignment.hand_in("picture.npy", RIGHT)
    tested = assignment.test(image_test(accept={"by": "verdict", "samples": 4}))
    assert (tested.status, tested.points) == ("error", 0)
    assert "layers error and samples" in tested.message


@pytest.mark.parametrize(("scale", "least"), [({}, 0), ({"zero": 0.5}, 5), ({"bands": [BAND]}, 5)])
def test_one_wrong_block_costs_points(assignment: Assignment, scale: dict[str, object], least: float) -> None:
    boxed = RIGHT.copy()
    boxed[8:16, 8:24] = (1, 0, 1)
    assignment.hand_in("picture.npy", boxed)
    tested = assignment.test(image_test(accept={"by": "verdict", "full": 0.2, **scale}))
    assert least <= tested.points < 10


def test_noise_hides_no_mistake_and_gives_a_signal(stripes: Assignment) -> None:
    """Pictures that are too bright by 0.02 lose their points as they are, and with any noise."""
    for deviation in (0.0, 0.02, 0.05, 0.2):
        stripes.hand_in("picture.npy", noisy(drawn(16, 1, 0.02), deviation))
        found = stripes.grade(noise_test(samples=4))
        codes = {signal.code for signal in found.signals}
        assert (deviation, found.score) == (deviation, 0)
        assert (deviation, codes) == (deviation, {"noise_without_samples"} if deviation else set())


@pytest.mark.parametrize(
    ("content", "message"),
    [(b"PK\x03\x04 cut off", "reference.npz is a damaged NPZ file."), (None, "has no array 'image'")],
)
def test_reference_that_is_no_picture_breaks_the_test(
    assignment: Assignment, content: bytes | None, message: str
) -> None:
    file = assignment.references / FILE
    if content is None:
        np.savez(file, pixels=np.zeros((8, 8, 3)))
    else:
        file.write_bytes(content)
    assignment.hand_in("picture.npy", np.zeros((8, 8, 3)))
    tested = assignment.test(noise_test())
    assert tested.status == "error"
    assert message in tested.message
