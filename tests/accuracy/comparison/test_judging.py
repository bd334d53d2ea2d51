"""The test that decides a verdict: one block far off, noise, or a mistake."""

import math
from typing import Any

import numpy as np
import pytest

from accuracy.comparison.asserting import compared
from accuracy.comparison.blocks import Bias, bias
from accuracy.comparison.judging import Judgement, Policy, judge
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
    assert (found.regions[0].x0, found.regions[0].y0) == (40, 16)


def test_fireflies_make_no_block_a_mismatch() -> None:
    """Six of the 64 pixels of a block, in every block."""
    reference, image = grey(3, 0.02), grey(4, 0.02)
    for row, column in ((0, 1), (2, 5), (3, 3), (5, 0), (6, 6), (7, 2)):
        image[row::8, column::8] = 1.0
    assert compared(image, reference).judgement.verdict == "noisy_match"


def test_noise_decides_where_too_few_blocks_are_biased() -> None:
    found = judge(equal=False, bias=CALM, scores=None, explained=False, policy=Policy(samples=4), noise=LOUD)
    assert (found.verdict, found.test, found.margin) == ("mismatch", "noise", pytest.approx(1 - 1 / 0.02))


def judged(ratios: list[float], explained: bool = False, **policy: Any) -> Judgement:
    found = Bias(np.array([ratios]), np.zeros((1, len(ratios))))
    return judge(equal=False, bias=found, scores=None, explained=explained, policy=Policy(**policy))


def verdict(ratios: list[float], most_bias: float = 0.25) -> str:
    return judged(ratios, most_bias=most_bias).verdict


def test_verdict_depends_on_the_share_of_biased_blocks() -> None:
    assert verdict([2.0, 0.5, 0.5, 0.5]) == "noisy_match"
    assert verdict([2.0, 2.0, 0.5, 0.5]) == "mismatch"
    assert verdict([1.0, 1.0, 1.0, 1.0]) == "noisy_match"
    assert verdict([math.inf, 0.0, 0.0, 0.0], 0.0) == "mismatch"


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
    found = judged([0.0], explained=True)
    assert (found.verdict, found.test, found.samples_factor) == ("mismatch", "diagnosis", None)


def test_small_block_is_never_beyond_doubt() -> None:
    assert not Bias(np.array([[math.inf]]), np.array([[0.5]]), pixels=1).beyond_doubt(0.0).any()
