"""Mistakes and verdicts of pictures made by hand."""

import math

import numpy as np
import pytest

from accuracy.comparison import Policy
from accuracy.comparison.blocks import Bias, bias
from accuracy.comparison.diagnosis import diagnose
from accuracy.comparison.judging import judge
from accuracy.comparison.metrics import luma
from accuracy.comparison.mistakes import moved


def causes(image: np.ndarray, reference: np.ndarray) -> list[str]:
    found = diagnose(image, reference, (luma(image), luma(reference)), np.full_like(image, 1e-6), 0.02)
    return [cause.cause for cause in found]


def plain() -> np.ndarray:
    """Bright rectangles on a dark ground, no two sides alike."""
    picture = np.full((40, 48, 3), 0.2)
    picture[6:20, 5:30] = [0.7, 0.4, 0.3]
    picture[25:34, 22:41] = [0.3, 0.6, 0.5]
    return picture


def test_stripes_that_any_smoothing_removes_are_no_shift() -> None:
    """Means of neighbours take them away, and so does the control that moves nothing."""
    stripes = plain() + np.where(np.arange(48) % 2, 0.1, -0.1)[None, :, None]
    assert causes(stripes, plain()) == []


def test_picture_of_two_pixels_has_no_cause() -> None:
    assert causes(np.zeros((2, 2, 3)), np.ones((2, 2, 3))) == []


@pytest.mark.parametrize(("right", "down"), [(1, 0), (-1, 0), (0, 1), (0, -1), (1, -1)])
def test_moved_picture_has_pixels_where_they_were_moved(right: int, down: int) -> None:
    picture = np.arange(20).reshape(4, 5)
    found = moved(picture, right, down)
    for row in range(1, 3):
        for column in range(1, 4):
            assert found[row, column] == picture[row - down, column - right]


def verdict(ratios: list[float], most_bias: float = 0.25) -> str:
    policy = Policy(most_bias=most_bias)
    found = Bias(np.array([ratios]), np.zeros((1, len(ratios))))
    return judge(equal=False, bias=found, scores=None, explained=False, policy=policy).verdict


def test_verdict_depends_on_the_share_of_biased_blocks() -> None:
    assert verdict([2.0, 0.5, 0.5, 0.5]) == "noisy_match"
    assert verdict([2.0, 2.0, 0.5, 0.5]) == "mismatch"
    assert verdict([1.0, 1.0, 1.0, 1.0]) == "noisy_match"
    assert verdict([math.inf, 0.0, 0.0, 0.0], 0.0) == "mismatch"


def test_margin_is_the_share_of_the_limit_that_is_left() -> None:
    found = judge(
        equal=False,
        bias=Bias(np.array([[2.0, 0.0, 0.0, 0.0, 0.0]]), np.zeros((1, 5))),
        scores=None,
        explained=False,
        policy=Policy(most_bias=0.4),
    )
    assert found.margin == pytest.approx(0.5)


def test_factor_of_samples_settles_blocks() -> None:
    """The difference stays and its noise falls with the root: biased from the factor on, not before."""
    noise = np.random.default_rng(2).normal(0.0, 0.1, (8, 8, 3))
    nothing = np.zeros_like(noise)
    ordered = np.sort(noise.reshape(64, 3), axis=0)
    shift = 0.02 - ordered[6:58].mean(axis=0)
    found = judge(
        equal=False,
        bias=bias(noise + shift, nothing),
        scores=None,
        explained=False,
        policy=Policy(most_bias=0.0),
    )
    assert found.verdict == "noisy_match"
    factor = found.samples_factor
    assert factor is not None
    for share, settled in ((0.98, False), (1.02, True)):
        quieter = 0.02 + (noise + shift - 0.02) / math.sqrt(share * factor)
        assert bool(bias(quieter, nothing).blocks[0, 0]) == settled


def test_diagnosis_decides_where_blocks_see_nothing() -> None:
    found = judge(
        equal=False,
        bias=Bias(np.zeros((1, 1)), np.zeros((1, 1))),
        scores=None,
        explained=True,
        policy=Policy(),
    )
    assert (found.verdict, found.test, found.samples_factor) == ("mismatch", "diagnosis", None)
