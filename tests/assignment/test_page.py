"""The page about the ready assignment tells what was measured, and that is what is expected."""

import json
import re
from pathlib import Path
from typing import Any

import pytest

from docs import generate_assignment_page as generator
from tests.assignment.mistakes import MISTAKES, RAYS, Mistake

FIGURES: dict[str, Any] = json.loads(generator.FIGURES.read_text(encoding="utf-8"))
MEASURED = {wrong["name"]: wrong for wrong in FIGURES["wrong"]}


def test_the_page_is_what_the_figures_say() -> None:
    assert generator.PAGE.read_text(encoding="utf-8") == generator.page(FIGURES)


def test_every_mistake_was_measured() -> None:
    assert list(MEASURED) == [mistake.name for mistake in MISTAKES]


def test_right_submissions_with_the_samples_that_are_asked_for_had_full_marks() -> None:
    assert {right["score"] for right in FIGURES["right"] if right["samples"] >= 16} == {125}


@pytest.mark.parametrize("mistake", MISTAKES, ids=lambda mistake: mistake.name)
def test_a_mistake_lost_what_it_should_and_was_told_rightly(mistake: Mistake) -> None:
    told = {part["test"].replace("-", "_"): part["told"] for part in MEASURED[mistake.name]["lost"]}
    assert told.keys() == mistake.fails.keys()
    for name, words in mistake.fails.items():
        named = told[name] if name in RAYS or not words else re.match(r"\*\*(\S+)\*\*", told[name])[1]  # type: ignore[index]
        assert words in named if name in RAYS or not words else words == named


def test_every_explanation_stands_on_the_page() -> None:
    page = Path(generator.PAGE).read_text(encoding="utf-8")
    assert all(part["told"] in page for wrong in FIGURES["wrong"] for part in wrong["lost"])
