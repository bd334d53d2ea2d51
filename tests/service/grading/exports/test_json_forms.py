"""Gradescope, PrairieLearn and Classroom 50, checked against their published fields and limits."""

from __future__ import annotations

import base64
import io
import json
from pathlib import Path
from typing import Any

import jsonschema
import pytest
from PIL import Image

from schemas.grading.grades import Grade
from service.grading.errors import ExportError
from service.grading.exports import EXPORTS, classroom50
from tests.service.grading.exports.samples import (
    FOR_STAFF,
    HIDDEN,
    broken,
    drawn,
    failed,
    hostile,
    many,
    not_gradable,
    result,
    secret,
    tried,
)

VISIBILITY = {"enum": ["hidden", "after_due_date", "after_published", "visible"]}
FORMAT = {"enum": ["text", "html", "simple_format", "md", "ansi"]}

# https://gradescope-autograders.readthedocs.io/en/latest/specs/ (Output format)
GRADESCOPE = {
    "type": "object",
    "additionalProperties": False,
    "required": ["score", "tests"],
    "properties": {
        "score": {"type": "number"},
        "execution_time": {"type": "number"},
        "output": {"type": "string"},
        "output_format": FORMAT,
        "test_output_format": FORMAT,
        "test_name_format": FORMAT,
        "visibility": VISIBILITY,
        "stdout_visibility": VISIBILITY,
        "extra_data": {"type": "object"},
        "leaderboard": {"type": "array"},
        "tests": {
            "type": "array",
            "items": {
                "type": "object",
                "additionalProperties": False,
                "properties": {
                    "score": {"type": "number"},
                    "max_score": {"type": "number"},
                    "status": {"enum": ["passed", "failed"]},
                    "name": {"type": "string"},
                    "name_format": FORMAT,
                    "number": {"type": "string"},
                    "output": {"type": "string"},
                    "output_format": FORMAT,
                    "tags": {"type": "array", "items": {"type": "string"}},
                    "visibility": VISIBILITY,
                    "extra_data": {"type": "object"},
                },
            },
        },
    },
}

IMAGES = {
    "type": "array",
    "items": {
        "type": "object",
        "required": ["url"],
        "additionalProperties": False,
        "properties": {
            "label": {"type": "string"},
            "url": {"type": "string", "pattern": "^data:image/png;base64,[A-Za-z0-9+/]+=*$"},
        },
    },
}

# https://prairielearn.readthedocs.io/en/latest/externalGrading/ (Grading results)
PRAIRIELEARN = {
    "type": "object",
    "properties": {
        "gradable": {"type": "boolean"},
        "score": {"type": "number", "minimum": 0, "maximum": 1},
        "message": {"type": "string"},
        "output": {"type": "string"},
        "images": IMAGES,
        "format_errors": {"type": ["string", "array"], "items": {"type": "string"}},
        "tests": {
            "type": "array",
            "items": {
                "type": "object",
                "additionalProperties": False,
                "properties": {
                    "name": {"type": "string"},
                    "description": {"type": "string"},
                    "points": {"type": "number"},
                    "max_points": {"type": "number"},
                    "message": {"type": "string"},
                    "output": {"type": "string"},
                    "images": IMAGES,
                },
            },
        },
    },
    "if": {"properties": {"gradable": {"const": False}}},
    "else": {"required": ["score"]},
}
PRAIRIELEARN_BYTES = 1_000_000

MOMENT = {"type": "string", "pattern": r"^\d{4}-\d{2}-\d{2}T([01]\d|2[0-3]):[0-5]\d:[0-5]\dZ$"}
WORDS = {"type": "string", "minLength": 1}
WHOLE = {"type": "integer", "minimum": 0}

# https://github.com/foundation50/classroom50/wiki/Advanced-Autograding#the-resultjson-contract
CLASSROOM50 = {
    "type": "object",
    "additionalProperties": False,
    "required": [
        "schema",
        "classroom",
        "assignment",
        "assignment_type",
        "owner",
        "submission",
        "commit",
        "release",
        "review",
        "datetime",
        "score",
        "max-score",
        "tests",
    ],
    "properties": {
        "schema": {"const": "classroom50/result/v1"},
        "classroom": WORDS,
        "assignment": WORDS,
        "assignment_type": {"enum": ["individual", "group"]},
        "owner": WORDS,
        "submission": {"type": "string", "pattern": "^submit/"},
        "commit": WORDS,
        "release": WORDS,
        "review": WORDS,
        "datetime": MOMENT,
        "graded_at": MOMENT,
        "score": WHOLE,
        "max-score": WHOLE,
        "submitted_by": {"type": "object"},
        "tests": {
            "type": "array",
            "items": {
                "type": "object",
                "required": ["test-name", "passed", "score", "max-score"],
                "properties": {
                    "test-name": WORDS,
                    "passed": {"type": "boolean"},
                    "score": WHOLE,
                    "max-score": WHOLE,
                },
            },
        },
    },
}

RUNNER = {
    "CLASSROOM": "graphics",
    "ASSIGNMENT": "tracer",
    "ASSIGNMENT_TYPE": "individual",
    "OWNER": "zoe",
    "SUBMISSION_TAG": "submit/2026-06-01T14-32-05Z-a1b2c3d",
    "COMMIT_URL": "https://example.org/commit/a1b2c3d",
    "RELEASE_URL": "https://example.org/releases/1",
}

FORMS = {"gradescope": GRADESCOPE, "prairielearn": PRAIRIELEARN, "classroom50": CLASSROOM50}

CASES = {
    "all kinds": result(tried(), failed(), not_gradable(), broken(), secret()),
    "hidden only": result(secret()),
    "nothing could be graded": result(not_gradable(), broken()),
    "not submitted": result(failed(status="skipped")),
    "bonus": result(tried(), tried("more", bonus=True)),
    "bonus only": result(tried("more", bonus=True)),
    "200 tests": many(),
    "hostile": hostile(),
}


@pytest.fixture(autouse=True)
def runner(monkeypatch: pytest.MonkeyPatch) -> None:
    """The environment variables of the Classroom 50 runner."""
    for name, value in RUNNER.items():
        monkeypatch.setenv(name, value)
    monkeypatch.delenv("REVIEW_URL", raising=False)


def exported(form: str, grade: Grade, pictures: Path | None = None) -> Any:
    document = json.loads(EXPORTS[form](grade, pictures))
    jsonschema.validate(document, FORMS[form])
    return document


@pytest.mark.parametrize("case", CASES)
@pytest.mark.parametrize("form", FORMS)
def test_a_document_has_the_published_fields_and_no_others(form: str, case: str) -> None:
    document = exported(form, CASES[case])
    assert document["tests"] != []


@pytest.mark.parametrize("form", FORMS)
def test_the_schemas_of_these_tests_refuse_what_the_platforms_refuse(form: str) -> None:
    document = exported(form, result(tried()))
    for fault in ({"score": "1"}, {"tests": None}):
        with pytest.raises(jsonschema.ValidationError):
            jsonschema.validate(document | fault, FORMS[form])


@pytest.mark.parametrize("form", FORMS)
def test_signals_are_in_no_document_that_students_may_see(form: str) -> None:
    assert FOR_STAFF not in json.dumps(exported(form, result(tried(), secret())))


@pytest.mark.parametrize("form", ["prairielearn", "classroom50"])
def test_hidden_tests_are_one_line_with_their_sum(form: str) -> None:
    document = exported(form, result(tried(), secret(), secret("other", points=1.0)))
    assert HIDDEN not in json.dumps(document)
    assert len(document["tests"]) == 2
    hidden = document["tests"][-1]
    names = (
        ("name", "points", "max_points") if form == "prairielearn" else ("test-name", "score", "max-score")
    )
    assert [hidden[name] for name in names] == ["Hidden tests", 5, 20]


@pytest.mark.parametrize(
    ("tags", "visibility"),
    [((), "hidden"), (("after_published",), "after_published"), (("after_due_date",), "after_due_date")],
)
def test_gradescope_hides_hidden_tests_until_a_tag_says_otherwise(
    tags: tuple[str, ...], visibility: str
) -> None:
    document = exported("gradescope", result(tried(tags=tags), secret(tags=tags)))
    assert [test["visibility"] for test in document["tests"]] == ["visible", visibility]
    assert document["stdout_visibility"] == "hidden"


def test_what_could_not_be_graded_has_no_score_on_gradescope() -> None:
    document = exported("gradescope", result(tried(), not_gradable(), broken()))
    fine, *rest = document["tests"]
    assert (fine["score"], fine["status"]) == (10, "passed")
    assert all({"score", "status"}.isdisjoint(test) and "not-gradable" in test["tags"] for test in rest)
    assert document["output"] == "10 of 30 points. 2 tests could not be graded: 20 points are open, not lost."


def test_no_attempt_is_lost_on_prairielearn_where_a_test_could_not_be_graded() -> None:
    document = exported("prairielearn", result(tried(), not_gradable()))
    assert document["gradable"] is False
    assert "score" not in document
    assert document["format_errors"] == ["Camera: The picture has 20 x 20 pixels, the reference 32 x 24."]


@pytest.mark.parametrize(("form", "score"), [("gradescope", 6.67), ("prairielearn", 0.4)])
def test_numbers_are_rounded(form: str, score: float) -> None:
    third = 10 / 3
    tests = [tried(points=third, status="partial"), tried("more", points=third, max_points=2 * third)]
    document = exported(form, result(*tests))
    assert document["score"] == score
    names = ("score", "max_score") if form == "gradescope" else ("points", "max_points")
    assert [[test[name] for name in names] for test in document["tests"]] == [[3.33, 10.0], [3.33, 6.67]]


def test_values_on_gradescope_have_six_digits() -> None:
    document = exported("gradescope", result(tried(value=0.1234567891)))
    assert document["tests"][0]["extra_data"]["value"] == 0.123457


@pytest.mark.parametrize(("points", "share"), [(0.0, 0.0), (2.5, 0.25), (10.0, 1.0)])
def test_the_score_on_prairielearn_is_a_share(points: float, share: float) -> None:
    assert exported("prairielearn", result(tried(points=points)))["score"] == share


def test_the_message_on_prairielearn_reports_points_beyond_the_full_score() -> None:
    document = exported("prairielearn", result(tried(), tried("more", bonus=True, points=2.5)))
    assert document["score"] == 1
    assert "12.5 points were earned" in document["message"]


@pytest.mark.parametrize(
    ("form", "limit"), [("gradescope", 2 * PRAIRIELEARN_BYTES), ("prairielearn", PRAIRIELEARN_BYTES)]
)
@pytest.mark.parametrize(("count", "width", "height"), [(1, 900, 700), (9, 400, 200), (30, 104, 96)])
def test_a_document_with_big_pictures_stays_within_its_limit_and_says_what_is_missing(
    tmp_path: Path, form: str, limit: int, count: int, width: int, height: int
) -> None:
    tests = [failed(f"test-{number}") for number in range(count)]
    grade = drawn(tmp_path, result(*tests), width, height)
    content = EXPORTS[form](grade, tmp_path)
    assert len(content) <= limit
    assert "1/" in json.loads(content)["output" if form == "gradescope" else "message"]


def test_200_tests_with_all_words_and_pictures_fit_into_prairielearn(tmp_path: Path) -> None:
    content = EXPORTS["prairielearn"](drawn(tmp_path, many(), 64, 48), tmp_path)
    assert len(content) <= PRAIRIELEARN_BYTES
    assert len(json.loads(content)["tests"]) == 200


def test_pictures_of_the_worst_tests_are_kept(tmp_path: Path) -> None:
    tests = [tried(f"fine-{number}") for number in range(60)] + [failed("bad")]
    document = exported("prairielearn", drawn(tmp_path, result(*tests), 400, 300), tmp_path)
    assert len(document["tests"][-1]["images"]) == 1
    kept = sum(len(test["images"]) for test in document["tests"])
    assert 1 < kept < 61
    assert f"{61 - kept} pictures are left out" in document["message"]


def test_pictures_that_fit_are_those_of_the_result_bit_for_bit(tmp_path: Path) -> None:
    document = exported("prairielearn", drawn(tmp_path, result(failed()), 104, 24), tmp_path)
    url = document["tests"][0]["images"][0]["url"]
    assert base64.b64decode(url.partition(",")[2]) == (tmp_path / "noise.png").read_bytes()
    assert "left out" not in document["message"]


def test_smaller_pictures_are_whole_pictures(tmp_path: Path) -> None:
    document = exported("prairielearn", drawn(tmp_path, result(failed()), 901, 700), tmp_path)
    content = base64.b64decode(document["tests"][0]["images"][0]["url"].partition(",")[2])
    with Image.open(io.BytesIO(content)) as picture:
        assert picture.size == (451, 350)


def test_words_on_gradescope_are_escaped_where_pictures_make_them_html(tmp_path: Path) -> None:
    document = exported("gradescope", drawn(tmp_path, hostile(), 104, 24), tmp_path)
    for test in document["tests"]:
        assert test["output_format"] == "html"
        assert "<script" not in test["output"]
        assert "<img src=x" not in test["output"]
        assert test["name_format"] == "text"


@pytest.mark.parametrize(
    ("points", "whole"), [(0.0, 0), (0.4, 0), (0.5, 1), (12.5, 13), (13.49, 13), (19.9, 20)]
)
def test_points_are_whole_on_classroom50_halves_up(points: float, whole: int) -> None:
    document = exported("classroom50", result(tried(points=points, max_points=20.0, status="partial")))
    assert document["score"] == document["tests"][0]["score"] == whole
    assert document["tests"][0]["passed"] is False


def test_no_score_is_above_its_maximum_on_classroom50() -> None:
    tests = [tried(f"test-{n}", points=n / 4, max_points=n / 4, bonus=n > 2) for n in range(8)]
    document = exported("classroom50", result(*tests))
    assert document["score"] == document["max-score"] == sum(test["max-score"] for test in document["tests"])


@pytest.mark.parametrize(
    ("submitted", "moment"),
    [
        ("2026-06-01T16:32:01+02:00", "2026-06-01T14:32:01Z"),
        ("2026-06-01T14:32:01Z", "2026-06-01T14:32:01Z"),
        (None, "2026-06-01T14:32:05Z"),
    ],
)
def test_the_time_of_the_submission_is_the_given_one_or_that_of_its_tag(
    submitted: str | None, moment: str
) -> None:
    assert exported("classroom50", result(tried(), submitted=submitted))["datetime"] == moment


def test_a_time_without_a_zone_is_refused() -> None:
    with pytest.raises(ExportError, match="has no time zone"):
        EXPORTS["classroom50"](result(tried(), submitted="2026-06-01T14:32:01"), None)


@pytest.mark.parametrize("name", ["CLASSROOM", "ASSIGNMENT", "SUBMISSION_TAG", "COMMIT_URL", "RELEASE_URL"])
def test_the_error_names_a_missing_variable_of_the_runner(name: str) -> None:
    environment = {known: value for known, value in RUNNER.items() if known != name}
    with pytest.raises(ExportError, match=f"^{name} is not set"):
        classroom50.export(result(tried()), None, environment)


def test_the_error_for_a_tag_without_a_time_names_the_option() -> None:
    with pytest.raises(ExportError, match="--submitted-at"):
        classroom50.export(result(tried(), submitted=None), None, RUNNER | {"SUBMISSION_TAG": "submit/v1"})
