"""The page about the ready assignment shows the measured figures, and they are as expected."""

import json
import re
from pathlib import Path
from typing import Any

import pytest

from tests.service.grading.assignment.mistakes import MISTAKES, RAYS, Mistake
from tools.docs import generate_assignment_page as generator

FIGURES: dict[str, Any] = json.loads(generator.FIGURES.read_text(encoding="utf-8"))
PROGRAM = {
    "words": "samples lie around the corner",
    "points_lost": 12.5,
    "verdict": "wrong",
    "named": ["`exposure`", "Many hits lie behind the origin."],
}
MEASURED = {wrong["name"]: wrong for wrong in FIGURES["wrong"]}


def test_every_mistake_was_measured() -> None:
    assert list(MEASURED) == [mistake.name for mistake in MISTAKES]


def test_correct_submissions_with_enough_samples_get_full_marks() -> None:
    assert {right["score"] for right in FIGURES["right"] if right["samples"] >= 16} == {125}


@pytest.mark.parametrize("mistake", MISTAKES, ids=lambda mistake: mistake.name)
def test_a_mistake_loses_the_expected_points_with_the_right_message(mistake: Mistake) -> None:
    messages = {part["test"].replace("-", "_"): part["message"] for part in MEASURED[mistake.name]["lost"]}
    assert messages.keys() == mistake.fails.keys()
    for name, words in mistake.fails.items():
        message = messages[name]
        named = message if name in RAYS or not words else re.match(r"\*\*(\S+)\*\*", message)[1]  # type: ignore[index]
        assert words in named if name in RAYS or not words else words == named


def test_every_message_is_on_the_page() -> None:
    page = Path(generator.PAGE).read_text(encoding="utf-8")
    assert all(part["message"] in page for wrong in FIGURES["wrong"] for part in wrong["lost"])


def test_whole_programs_are_shown_once_they_are_measured() -> None:
    without = {name: part for name, part in FIGURES.items() if name != "programs"}
    measured = {"machine": FIGURES["machine"], "programs": [PROGRAM]}
    page = generator.page(without | {"programs": measured})
    row = "| samples lie around the corner | 12.5 | `exposure`<br>Many hits lie behind the origin. | wrong |"
    assert page.count(row) == 1
    assert "named wrong: 1 (goal: 0); the goal is missed" in page
    assert "Whole wrong programs" not in generator.page(without)
