"""A picture is judged by two references that know nothing of each other."""

import math

import numpy as np
import pytest

from accuracy.statistics import rms_difference
from accuracy.study.reference import Reference

SHAPE = (60, 80, 3)
TRUTH = np.full(SHAPE, 0.5)
NOISE = 0.05
ONE_IN_A_MILLION = 4.9  # standard deviations, both sides
SPREAD = ONE_IN_A_MILLION / math.sqrt(800)
"""Relative error of the standard deviation of 400 normal numbers."""


def reference(rng: np.random.Generator, noise: float = NOISE) -> Reference:
    return Reference(*(TRUTH + rng.normal(0, noise, SHAPE) for _ in range(2)))


@pytest.mark.parametrize("off", [0.0, 0.01, 0.1])
def test_error_is_judged_without_bias(off: float) -> None:
    """By coarse references of known noise: within 4.9 standard errors of the true one."""
    rng = np.random.default_rng(2)
    image = TRUTH + off * rng.choice([-1.0, 1.0], SHAPE)
    found = [reference(rng).judge(image) for _ in range(400)]
    judged = [one.mse for one in found]
    room = ONE_IN_A_MILLION * np.std(judged) / math.sqrt(len(judged))
    assert abs(np.mean(judged) - off**2) <= room
    # Without taking it away, the reference's own error, half of NOISE squared, would be far outside.
    assert 10 * room < NOISE**2 / 2
    assert abs(np.std(judged) / np.mean([one.by_reference for one in found]) - 1) <= SPREAD


def test_bound_from_pixels_holds_for_independent_errors() -> None:
    rng = np.random.default_rng(4)
    judged = reference(rng, 0.001)
    verdicts = [judged.judge(TRUTH + rng.normal(0, 0.1, SHAPE)) for _ in range(400)]
    bound = np.mean([one.by_pixels for one in verdicts]) * (1 + SPREAD)
    assert np.std([one.mse for one in verdicts]) <= bound


def test_errors_beside_edges_are_judged_apart() -> None:
    """Both sides of a step are beside an edge; a picture without edges has no error beside them."""
    step = np.zeros((4, 6, 3))
    step[:, 3:] = 0.5
    edges = Reference(step, step).edges()
    assert edges.all(axis=0).tolist() == [False, False, True, True, False, False]
    turned = step.swapaxes(0, 1)
    assert np.array_equal(Reference(turned, turned).edges(), edges.T)
    image = step.copy()
    image[:, 2] += 0.2
    image[:, 0] += 0.1
    judged = Reference(step, step).judge(image)
    assert judged.edges_mse == pytest.approx(0.2**2 / 2)
    assert judged.smooth_mse == pytest.approx(0.1**2 / 4)
    assert judged.mse == pytest.approx((0.2**2 + 0.1**2) / 6)
    assert Reference(TRUTH, TRUTH).judge(TRUTH + 0.1).edges_mse == 0


def test_difference_beyond_white_is_no_error() -> None:
    white = np.ones(SHAPE)
    assert Reference(white, white).judge(white + 7).mse == 0
    assert rms_difference(white + 7, white) == 0
