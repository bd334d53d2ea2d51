"""A picture is judged by two references that know nothing of each other."""

from __future__ import annotations

import math

import numpy as np
import pytest
from numpy.typing import NDArray

from accuracy.statistics import rms_difference
from accuracy.study.reference import HOT, Reference

SHAPE = (60, 80, 3)
TRUTH = np.full(SHAPE, 0.5)
NOISE = 0.05
ONE_IN_A_MILLION = 4.9  # standard deviations, both sides


def reference(rng: np.random.Generator, noise: float = NOISE) -> Reference:
    return Reference(*(TRUTH + rng.normal(0, noise, SHAPE) for _ in range(2)))


def test_the_error_is_the_measured_one_less_that_of_the_reference() -> None:
    rng = np.random.default_rng(1)
    judged = reference(rng)
    image = TRUTH + rng.uniform(-0.1, 0.1, SHAPE)
    measured = float(np.mean((image - judged.mean) ** 2))
    # Sums of 14400 products of at most 1: each rounds by less than an eps.
    assert judged.judge(image).mse == pytest.approx(measured - judged.own_mse, abs=np.prod(SHAPE) * 2.3e-16)


@pytest.mark.parametrize("off", [0.0, 0.01, 0.1])
def test_the_error_is_judged_without_bias_however_coarse_the_reference_is(off: float) -> None:
    """200 references of known noise: the mean is within 4.9 of its standard errors of the true one."""
    rng = np.random.default_rng(2)
    image = TRUTH + off * rng.choice([-1.0, 1.0], SHAPE)
    judged = [reference(rng).judge(image).mse for _ in range(200)]
    assert abs(np.mean(judged) - off**2) <= ONE_IN_A_MILLION * np.std(judged) / math.sqrt(len(judged))
    # Without taking it away, the reference's own error, half of NOISE squared, would be far outside.
    assert 10 * ONE_IN_A_MILLION * np.std(judged) / math.sqrt(len(judged)) < NOISE**2 / 2


@pytest.mark.parametrize("off", [0.0, 0.1])
def test_the_standard_error_is_that_of_many_references(off: float) -> None:
    """The spread of 400 normal numbers is known to 1 / sqrt(800): 4.9 of these are 17 %."""
    rng = np.random.default_rng(3)
    image = TRUTH + off * rng.choice([-1.0, 1.0], SHAPE)
    judged = [reference(rng).judge(image) for _ in range(400)]
    ratio = np.std([one.mse for one in judged]) / np.mean([one.by_reference for one in judged])
    assert abs(ratio - 1) <= ONE_IN_A_MILLION / math.sqrt(800)


def test_the_bound_from_pixels_holds_for_pictures_whose_pixels_err_independently() -> None:
    rng = np.random.default_rng(4)
    judged = reference(rng, 0.001)
    verdicts = [judged.judge(TRUTH + rng.normal(0, 0.1, SHAPE)) for _ in range(400)]
    spread = np.std([one.mse for one in verdicts])
    assert spread <= np.mean([one.by_pixels for one in verdicts]) * (1 + ONE_IN_A_MILLION / math.sqrt(800))


def test_the_mean_of_the_halves_has_a_quarter_of_the_squared_error_between_them() -> None:
    halves = Reference(np.zeros((1, 1, 3)), np.full((1, 1, 3), 0.2))
    assert halves.own_mse == pytest.approx(0.01)


def stepped() -> NDArray[np.float64]:
    picture = np.zeros((4, 6, 3))
    picture[:, 3:] = 0.5
    return picture


def test_both_sides_of_a_step_are_beside_an_edge() -> None:
    edges = Reference(stepped(), stepped()).edges()
    assert edges.all(axis=0).tolist() == [False, False, True, True, False, False]
    assert np.array_equal(Reference(stepped().swapaxes(0, 1), stepped().swapaxes(0, 1)).edges(), edges.T)


def test_errors_beside_edges_and_elsewhere_are_judged_apart() -> None:
    image = stepped()
    image[:, 2] += 0.2
    image[:, 0] += 0.1
    judged = Reference(stepped(), stepped()).judge(image)
    assert judged.edges_mse == pytest.approx(0.2**2 / 2)
    assert judged.smooth_mse == pytest.approx(0.1**2 / 4)
    assert judged.mse == pytest.approx((0.2**2 + 0.1**2) / 6)


def test_a_picture_without_edges_has_no_error_beside_them() -> None:
    assert Reference(TRUTH, TRUTH).judge(TRUTH + 0.1).edges_mse == 0


def test_hot_pixels_are_those_off_by_a_tenth_in_any_channel() -> None:
    image = TRUTH.copy()
    image[0, 0, 2] += HOT + 0.01
    image[0, 1] -= HOT - 0.01
    assert Reference(TRUTH, TRUTH).judge(image).hot == pytest.approx(1 / (60 * 80))


def test_what_cannot_be_displayed_is_no_error() -> None:
    white = np.ones(SHAPE)
    assert Reference(white, white).judge(white + 7).mse == 0
    assert rms_difference(white + 7, white) == 0
