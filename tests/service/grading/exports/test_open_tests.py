"""PrairieLearn, where a test could not be graded: no lost attempt, no lost score, and no free reference."""

from __future__ import annotations

from pathlib import Path

from tests.service.grading.exports.samples import drawn, failed, not_gradable, result, tried
from tests.service.grading.exports.test_json_forms import exported


def test_an_open_bonus_test_withholds_no_score_on_prairielearn() -> None:
    bonus = not_gradable().model_copy(update={"bonus": True})
    document = exported("prairielearn", result(tried(points=5.0), bonus))
    assert (document["gradable"], document["score"]) == (True, 0.5)
    assert "format_errors" not in document


def test_a_bonus_test_alone_that_is_open_is_not_gradable_on_prairielearn() -> None:
    bonus = not_gradable().model_copy(update={"bonus": True})
    assert exported("prairielearn", result(bonus))["gradable"] is False


def test_no_reference_is_shown_on_prairielearn_for_an_attempt_that_costs_nothing(tmp_path: Path) -> None:
    grade = drawn(tmp_path, result(failed(), not_gradable()), 104, 24)
    free = exported("prairielearn", grade, tmp_path)
    assert [test["images"] for test in free["tests"]] == [[], []]
    counted = exported("prairielearn", drawn(tmp_path, result(failed()), 104, 24), tmp_path)
    assert len(counted["tests"][0]["images"]) == 1
