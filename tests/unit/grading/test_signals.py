from __future__ import annotations

import numpy as np
import pytest

from renderer.comparison import Comparison, compare
from service.grading.signals import signals
from tests.unit.renderer.comparison.test_closeness import NOISE, noisy, picture


def compared(image: np.ndarray, reference: np.ndarray) -> Comparison:
    return compare(picture(image), picture(reference, NOISE))


def test_the_reference_itself_is_flagged_once() -> None:
    found = signals(b"same", b"same", compared(noisy(1), noisy(1)), test="soft")
    assert [(signal.test, signal.code) for signal in found] == [("soft", "identical_bytes")]


def test_a_copy_in_another_form_is_flagged_with_its_count() -> None:
    (found,) = signals(b"a", b"b", compared(noisy(1), noisy(1)), test="soft")
    assert found.code == "closer_than_noise"
    assert found.message.endswith("with the same seed.")


@pytest.mark.parametrize("reference", [b"b", None])
def test_a_picture_of_its_own_is_not_flagged(reference: bytes | None) -> None:
    assert signals(b"a", reference, compared(noisy(1), noisy(2)), test="soft") == ()


def test_scenes_are_held_to_their_bytes_alone() -> None:
    assert signals(b"a", b"b", None, test="soft") == ()
    assert len(signals(b"a", b"a", None, test="soft")) == 1


def test_a_reference_that_does_not_tell_its_noise_flags_nothing() -> None:
    image = picture(noisy(1))
    assert signals(b"a", b"b", compare(image, image), test="soft") == ()
