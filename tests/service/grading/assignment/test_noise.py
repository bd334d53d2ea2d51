"""Noise, blurs and copies in the ready assignment: a few are graded here, the kept figures say the rest."""

from functools import cache
from typing import Any

import numpy as np
import pytest

from accuracy.comparison.blurs import smoothed
from service.grading.outcomes import Outcome
from tests.service.grading.assignment import noise, program
from tests.service.grading.assignment.tracer import Tracer
from tools.docs import figures, measure_noise
from tools.docs.measure_noise import Bench, scene_of

FIGURES: dict[str, Any] = figures.read("noise")
TESTS = {scene_of(test): test for test in measure_noise.image_tests()}


@pytest.fixture
def bench() -> Bench:
    return Bench()


@cache
def tracer(name: str, *wrong: str) -> Tracer:
    return Tracer(program.read(noise.FOLDER, name), noise.FOLDER, frozenset(wrong))


def graded(bench: Bench, name: str, linear: np.ndarray) -> Outcome:
    return bench.grade(TESTS[name], measure_noise.codes_of(TESTS[name], linear))


@pytest.mark.parametrize("kind", ["Gaussian 0.05", "uniform 0.1", "blue 0.1", "salt and pepper 0.25"])
def test_noise_buys_no_points(bench: Bench, kind: str) -> None:
    wrong = tracer("phong_matte", "no_ambient").picture()
    noisy = noise.KINDS[kind](wrong, np.random.default_rng(1))
    outcome = graded(bench, "phong_matte", noisy)
    assert outcome.share == 0
    assert "noise_without_samples" in {signal.code for signal in outcome.signals}


def test_a_blur_is_no_antialiasing(bench: Bench) -> None:
    blurred = smoothed(tracer("antialiasing", "one_sample").picture(), 0.8)
    outcome = graded(bench, "antialiasing", blurred)
    assert outcome.share == 0
    assert [cause.cause for cause in outcome.diagnosis] == ["blurred"]


@pytest.mark.parametrize("deviation", measure_noise.LITTLE)
def test_the_reference_with_a_little_noise_is_signalled(bench: Bench, deviation: int) -> None:
    found = measure_noise.copies(bench, TESTS["antialiasing"], deviation)
    assert found["flagged"] == found["pictures"]


@pytest.mark.parametrize("name", TESTS)
def test_honest_pictures_lose_no_points_and_give_no_signal(name: str) -> None:
    for found in FIGURES["scenes"][name]["honest"]:
        # Neither 4 nor 16 random samples are enough for advanced anti-aliasing.
        if name != "antialiasing_advanced" or found["samples"] > 16:
            assert found["lost"] == 0
        assert found["signals"] == {}


def test_noise_added_everywhere_earns_no_more() -> None:
    """More is earned only by noise put where a picture is wrong, and by that of the fewest samples."""
    wrong = [part for found in FIGURES["scenes"].values() for part in found["wrong"]]
    assert len(wrong) == len(measure_noise.WRONG) * 10
    kinds = {kind for part in wrong for kind in part["more"]}
    assert kinds & set(noise.KINDS) == set()
    assert sum(len(part["more"]) for part in wrong) < sum(part["pictures"] for part in wrong) / 100


def test_blurs_earn_nothing_for_antialiasing() -> None:
    assert [part["share"] for part in FIGURES["scenes"]["antialiasing"]["blurs"]] == [0.0] * 8


def test_copies_are_signalled() -> None:
    """Where all pixels are noisy, noise of 4 codes hides that a picture is a copy."""
    for name, found in FIGURES["scenes"].items():
        for part in found["copies"]:
            hidden = name == "shadow_soft" and part["deviation"] == 4
            assert part["flagged"] == (0 if hidden else part["pictures"])


def test_figures_are_of_all_seeds() -> None:
    assert FIGURES["seeds"] == measure_noise.SEEDS
