"""Target quality keeps its promise on scenes that were not chosen.

Consecutive numbers give the scenes; `python -m benchmarks targets` renders more and larger ones. Of all pairs
of a scene and a target as many may miss as a renderer that misses with the stated probability exceeds once in
a thousand runs, were pairs independent; those of one scene are not quite. So few pairs find coarse faults
only: a renderer that misses one target in five passes two runs in three, and the benchmark finds it. The
true error is free of the references' noise (`Reference`).
"""

from functools import cache
from math import comb

import pytest

from benchmarks.everyday_scenes import everyday_scene, files
from benchmarks.targets import Pair, pairs_of
from renderer import load_scene

pytestmark = pytest.mark.slow

FIRST, COUNT = 20261122, 8
TARGETS_255 = 2.0, 1.0, 0.5
SCALE = 0.3
"""Of the sides of the pictures: references are most of the time."""

RARE = 1e-3
"""Probability that a right renderer fails one of these tests."""


@cache
def pairs() -> list[Pair]:
    numbers = range(FIRST, FIRST + COUNT)
    return [pair for number in numbers for pair in pairs_of(number, TARGETS_255, scale=SCALE)]


def most_misses(probability: float, trials: int) -> int:
    """Least number that misses of such a probability exceed with no more than `RARE`."""
    rest = 1.0
    for misses in range(trials):
        rest -= comb(trials, misses) * probability**misses * (1 - probability) ** (trials - misses)
        if rest <= RARE:
            return misses
    return trials


def test_misses_are_counted_as_the_binomial_distribution_says() -> None:
    assert most_misses(0.5, 10) == 9
    assert most_misses(0.05, 24) == 5
    assert most_misses(0.08, 24) == 7


def test_a_target_is_kept_by_95_of_100_everyday_scenes() -> None:
    over = [pair for pair in pairs() if pair["true"] > pair["target"]]
    assert len(over) <= most_misses(0.05, len(pairs())), over


def test_the_interval_holds_the_true_error_in_92_of_100_everyday_scenes() -> None:
    outside = [pair for pair in pairs() if not pair["low"] <= pair["true"] <= pair["high"]]
    assert len(outside) <= most_misses(0.08, len(pairs())), outside


def test_posts_of_a_pixel_that_are_lit_from_the_side_keep_their_target() -> None:
    """A field where five pixels at the tips of posts made 0.66/255 where 0.38/255 was reported."""
    (pair,) = pairs_of(20261135, (0.5,))
    assert pair["low"] <= pair["true"] <= pair["high"] <= pair["target"], pair


def test_every_kind_of_scene_comes_up_and_is_accepted() -> None:
    documents = [everyday_scene(number) for number in range(60)]
    for document in documents:
        load_scene(document, assets=files())
    assert len({document["name"].split("-")[0] for document in documents}) == 7
    assert {light["type"] for document in documents for light in document["lights"]} == {
        "rectangle",
        "point",
        "directional",
    }


def test_a_number_gives_the_same_scene_each_time() -> None:
    assert everyday_scene(7) == everyday_scene(7) != everyday_scene(8)
