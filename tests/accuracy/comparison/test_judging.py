"""Which test decides: a single block off by far, noise, or a mistake."""

import math

import numpy as np
import pytest

from accuracy.comparison.asserting import compared
from accuracy.comparison.blocks import Bias
from accuracy.comparison.judging import Policy, judge
from accuracy.comparison.noise import Noise

CALM = Bias(np.zeros((10, 10)), np.zeros((10, 10)))
LOUD = Noise(np.full((10, 10), 2.0), np.zeros((10, 10), np.int64), 4)


def grey(seed: int, deviation: float) -> np.ndarray:
    return np.clip(np.random.default_rng(seed).normal(0.5, deviation, (64, 64, 3)), 0, 1)


def test_red_block_is_a_mismatch_by_itself() -> None:
    reference, image = grey(1, 0.05), grey(2, 0.05)
    assert compared(image, reference).judgement.verdict == "noisy_match"
    image[16:24, 40:48] = [0.9, 0.1, 0.1]
    found = compared(image, reference)
    assert (found.judgement.verdict, found.judgement.test) == ("mismatch", "block")
    assert found.judgement.reason.startswith("One block of 8 x 8 pixels is off by up to 0.4 more")
    assert (found.regions[0].x0, found.regions[0].y0) == (40, 16)


def test_fireflies_make_no_block_a_mismatch() -> None:
    """Six of the 64 pixels of a block, in every block."""
    reference, image = grey(3, 0.02), grey(4, 0.02)
    for row, column in ((0, 1), (2, 5), (3, 3), (5, 0), (6, 6), (7, 2)):
        image[row::8, column::8] = 1.0
    assert compared(image, reference).judgement.verdict == "noisy_match"


def test_small_block_is_never_beyond_doubt() -> None:
    assert not Bias(np.array([[math.inf]]), np.array([[0.5]]), pixels=1).beyond_doubt(0.0).any()


def test_noise_decides_where_too_few_blocks_are_biased() -> None:
    found = judge(equal=False, bias=CALM, scores=None, explained=False, policy=Policy(samples=4), noise=LOUD)
    assert (found.verdict, found.test, found.margin) == ("mismatch", "noise", pytest.approx(1 - 1 / 0.02))


def test_mistake_outranks_noise_as_the_reason() -> None:
    found = judge(equal=False, bias=CALM, scores=None, explained=True, policy=Policy(samples=4), noise=LOUD)
    assert (found.verdict, found.test) == ("mismatch", "diagnosis")
