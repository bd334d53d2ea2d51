"""Signals of a test: copies of the reference are signalled to staff, and cost no points."""

import numpy as np
import pytest

from accuracy.comparison import Comparison, compare
from service.grading.likeness.signals import signals
from tests.service.grading.assignments import Assignment, image_test
from tests.service.grading.likeness.test_closeness import NOISE, SAMPLES, noisy, picture


def compared(image: np.ndarray, reference: np.ndarray) -> Comparison:
    return compare(picture(image), picture(reference, NOISE))


@pytest.mark.parametrize("reference", [b"b", None])
def test_independent_picture_gives_no_signal(reference: bytes | None) -> None:
    assert signals(b"a", reference, compared(noisy(1), noisy(2)), test="soft") == ()


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
