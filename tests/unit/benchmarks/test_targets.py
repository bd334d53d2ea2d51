"""Whether pictures reach their targets is counted, and the page about accuracy gives the counts."""

import pytest

from benchmarks.targets import SETS, Pair, summary
from tools.docs import fill_figures


def pair(target: float, low: float, high: float, true: float) -> Pair:
    return Pair(
        scene="room",
        target=target,
        estimate=(low + high) / 2,
        low=low,
        high=high,
        true=true,
        doubt=0.1,
        samples=8.0,
        cpu_seconds=0.5,
    )


PAIRS = [
    pair(2.0, 1.0, 1.5, 1.2),  # reached, in the interval
    pair(1.0, 0.6, 0.8, 0.9),  # reached, above the interval
    pair(1.0, 0.8, 1.2, 1.1),  # missed, in the interval
]


def test_targets_that_are_reached_and_intervals_that_hold_are_counted() -> None:
    found = summary(PAIRS)
    assert (found["pairs"], found["kept"], found["held"]) == (3, 2, 2)
    assert found["ratios"][1] == pytest.approx(0.9)
    assert found["cpu_seconds"] == pytest.approx(1.5)


def test_no_scene_is_in_two_sets() -> None:
    numbers = [first + number for first, scenes in SETS.values() for number in range(scenes)]
    assert len(numbers) == len(set(numbers))


def test_the_page_counts_pictures_of_scenes_that_led_to_no_change_first() -> None:
    machine = {"date": "2026-01-02", "cpu": "Xeon", "cores": 2, "python": "3.11.7"}
    fresh = {"first": 7, "scenes": 1, "summary": summary(PAIRS)}
    text = fill_figures.target_errors(
        {"machine": machine, "targets": {"fresh": fresh, "developed": {**fresh, "first": 9}}}
    )
    text = " ".join(text.split())
    counts = [text.index(words) for words in ("number 7, 2 of 3", "0.90", "number 9, 2 of 3", "2026-01-02")]
    assert counts == sorted(counts)
