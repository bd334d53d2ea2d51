"""Gradescope, PrairieLearn and Classroom 50, checked against their published fields and limits."""

import json
from pathlib import Path
from typing import Any

import jsonschema
import pytest

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

Schema = dict[str, Any]

NUMBER: Schema = {"type": "number"}
TEXT: Schema = {"type": "string"}
WORDS = TEXT | {"minLength": 1}
WHOLE: Schema = {"type": "integer", "minimum": 0}
TRUTH: Schema = {"type": "boolean"}
ANY: Schema = {"type": "object"}


def listed(items: Schema) -> Schema:
    return {"type": "array", "items": items}


def each(schema: Schema, names: str) -> Schema:
    return dict.fromkeys(names.split(), schema)


def closed(properties: Schema, required: str = "") -> Schema:
    """An object with these fields and no others."""
    fields = {"properties": properties, "required": required.split()}
    return ANY | {"additionalProperties": False} | fields


VISIBILITY = {"enum": ["hidden", "after_due_date", "after_published", "visible"]}
FORMAT = {"enum": ["text", "html", "simple_format", "md", "ansi"]}

# https://gradescope-autograders.readthedocs.io/en/latest/specs/ (Output format)
GRADESCOPE_TEST = {
    **each(NUMBER, "score max_score"),
    **each(TEXT, "name number output"),
    **each(FORMAT, "name_format output_format"),
    "status": {"enum": ["passed", "failed"]},
    "tags": listed(TEXT),
    "visibility": VISIBILITY,
    "extra_data": ANY,
}
GRADESCOPE = {
    **each(NUMBER, "score execution_time"),
    **each(FORMAT, "output_format test_output_format test_name_format"),
    **each(VISIBILITY, "visibility stdout_visibility"),
    "output": TEXT,
    "extra_data": ANY,
    "leaderboard": {"type": "array"},
    "tests": listed(closed(GRADESCOPE_TEST)),
}

# https://prairielearn.readthedocs.io/en/latest/externalGrading/ (Grading results)
URL = TEXT | {"pattern": "^data:image/png;base64,[A-Za-z0-9+/]+=*$"}
IMAGES = {"images": listed(closed({"label": TEXT, "url": URL}, "url"))}
PRAIRIELEARN_TEST = each(TEXT, "name description message output") | each(NUMBER, "points max_points") | IMAGES
PRAIRIELEARN = {
    **each(TEXT, "message output"),
    "gradable": TRUTH,
    "score": NUMBER | {"minimum": 0, "maximum": 1},
    "format_errors": {"type": ["string", "array"], "items": TEXT},
    "tests": listed(closed(PRAIRIELEARN_TEST)),
    **IMAGES,
}
GRADABLE = {"if": {"properties": {"gradable": {"const": False}}}, "else": {"required": ["score"]}}
PRAIRIELEARN_BYTES = 1_000_000

# https://github.com/foundation50/classroom50/wiki/Advanced-Autograding#the-resultjson-contract
MOMENT = TEXT | {"pattern": r"^\d{4}-\d{2}-\d{2}T([01]\d|2[0-3]):[0-5]\d:[0-5]\dZ$"}
CLASSROOM50_TEST = each(WHOLE, "score max-score") | {"test-name": WORDS, "passed": TRUTH}
CLASSROOM50 = {
    **each(WORDS, "classroom assignment owner commit release review"),
    **each(MOMENT, "datetime graded_at"),
    **each(WHOLE, "score max-score"),
    "schema": {"const": "classroom50/result/v1"},
    "submission": TEXT | {"pattern": "^submit/"},
    "assignment_type": {"enum": ["individual", "group"]},
    "submitted_by": ANY,
    "tests": listed({"properties": CLASSROOM50_TEST, "required": [*CLASSROOM50_TEST]}),
}
OPTIONAL = {"graded_at", "submitted_by"}

RUNNER = {
    "CLASSROOM": "graphics",
    "ASSIGNMENT": "tracer",
    "ASSIGNMENT_TYPE": "individual",
    "OWNER": "zoe",
    "SUBMISSION_TAG": "submit/2026-06-01T14-32-05Z-a1b2c3d",
    "COMMIT_URL": "https://example.org/commit/a1b2c3d",
    "RELEASE_URL": "https://example.org/releases/1",
}

FORMS = {
    "gradescope": closed(GRADESCOPE, "score tests"),
    "prairielearn": closed(PRAIRIELEARN) | GRADABLE,
    "classroom50": closed(CLASSROOM50, " ".join(CLASSROOM50.keys() - OPTIONAL)),
}

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


@pytest.mark.parametrize("form", FORMS)
def test_document_has_the_published_fields_and_no_others(form: str) -> None:
    for grade in CASES.values():
        assert exported(form, grade)["tests"] != []


@pytest.mark.parametrize("form", EXPORTS)
def test_control_and_direction_characters_are_in_no_form(form: str) -> None:
    written = EXPORTS[form](hostile(), None).decode()
    assert {c for c in written if not c.isprintable()} <= {"\n", "\r"}


@pytest.mark.parametrize("form", FORMS)
def test_signals_are_in_no_document_of_students(form: str) -> None:
    assert FOR_STAFF not in json.dumps(exported(form, result(tried(), secret())))


@pytest.mark.parametrize(
    ("form", "names"),
    [
        ("prairielearn", ("name", "points", "max_points")),
        ("classroom50", ("test-name", "score", "max-score")),
    ],
)
def test_hidden_tests_are_one_line_with_their_sum(form: str, names: tuple[str, ...]) -> None:
    document = exported(form, result(tried(), secret(), secret("other", points=1.0)))
    assert HIDDEN not in json.dumps(document)
    assert len(document["tests"]) == 2
    assert [document["tests"][-1][name] for name in names] == ["Hidden tests", 5, 20]


@pytest.mark.parametrize("tags", [(), ("after_published",), ("after_due_date",)])
def test_gradescope_hides_hidden_tests_until_a_tag_says_so(tags: tuple[str, ...]) -> None:
    document = exported("gradescope", result(tried(tags=tags), secret(tags=tags)))
    assert [test["visibility"] for test in document["tests"]] == ["visible", *(tags or ("hidden",))]
    assert document["stdout_visibility"] == "hidden"


def test_gradescope_leaves_open_tests_without_a_score() -> None:
    fine, *rest = exported("gradescope", result(tried(), not_gradable(), broken()))["tests"]
    assert (fine["score"], fine["status"]) == (10, "passed")
    assert all({"score", "status"}.isdisjoint(test) and "not-gradable" in test["tags"] for test in rest)


def test_prairielearn_loses_no_attempt_on_open_tests(tmp_path: Path) -> None:
    grade = drawn(tmp_path, result(failed(), not_gradable()), 104, 24)
    document = exported("prairielearn", grade, tmp_path)
    assert document["gradable"] is False
    assert "score" not in document
    assert len(document["format_errors"]) == 1
    # An attempt that costs nothing tells neither points nor causes, and shows no reference.
    assert [(test["name"], test["images"]) for test in document["tests"]] == [("Camera", [])]


def test_prairielearn_open_bonus_test_withholds_no_score() -> None:
    bonus = not_gradable().model_copy(update={"bonus": True})
    document = exported("prairielearn", result(tried(points=5.0), bonus))
    assert (document["gradable"], document["score"]) == (True, 0.5)
    assert "format_errors" not in document
    assert exported("prairielearn", result(bonus))["gradable"] is False
    only = failed(bonus=True), tried(bonus=True)
    assert exported("prairielearn", result(*only))["score"] == 0.5


@pytest.mark.parametrize(
    ("form", "limit"), [("gradescope", 2 * PRAIRIELEARN_BYTES), ("prairielearn", PRAIRIELEARN_BYTES)]
)
@pytest.mark.parametrize(("count", "width", "height"), [(1, 900, 700), (9, 400, 200), (30, 104, 96)])
def test_big_pictures_stay_within_the_limit(
    tmp_path: Path, form: str, limit: int, count: int, width: int, height: int
) -> None:
    grade = drawn(tmp_path, result(*(failed(f"test-{number}") for number in range(count))), width, height)
    content = EXPORTS[form](grade, tmp_path)
    assert len(content) <= limit
    # It says to which part pictures were reduced.
    assert "1/" in json.loads(content)["output" if form == "gradescope" else "message"]


def test_pictures_of_the_worst_tests_are_kept(tmp_path: Path) -> None:
    tests = [tried(f"fine-{number}") for number in range(60)] + [failed("bad")]
    found = exported("prairielearn", drawn(tmp_path, result(*tests), 400, 300), tmp_path)["tests"]
    assert len(found[-1]["images"]) == 1
    assert 1 < sum(len(test["images"]) for test in found) < 61


def test_gradescope_words_are_escaped_in_html(tmp_path: Path) -> None:
    tests = exported("gradescope", drawn(tmp_path, hostile(), 104, 24), tmp_path)["tests"]
    assert tests[0]["output"].startswith("<p>&lt;script&gt;")
    for test in tests:
        assert (test["output_format"], test["name_format"]) == ("html", "text")
        assert "<script" not in test["output"]
        assert "<img src=x" not in test["output"]


@pytest.mark.parametrize(("points", "whole"), [(0.0, 0), (0.4, 0), (0.5, 1), (12.5, 13), (13.49, 13)])
def test_classroom50_points_are_whole_halves_up(points: float, whole: int) -> None:
    document = exported("classroom50", result(tried(points=points, max_points=20.0, status="partial")))
    assert document["score"] == document["tests"][0]["score"] == whole
    assert document["tests"][0]["passed"] is False


@pytest.mark.parametrize(
    ("submitted", "moment"),
    [
        ("2026-06-01T16:32:01+02:00", "2026-06-01T14:32:01Z"),
        ("2026-06-01T14:32:01Z", "2026-06-01T14:32:01Z"),
        (None, "2026-06-01T14:32:05Z"),
    ],
)
def test_classroom50_time_is_given_or_that_of_the_tag(submitted: str | None, moment: str) -> None:
    assert exported("classroom50", result(tried(), submitted=submitted))["datetime"] == moment


@pytest.mark.parametrize(
    ("changes", "submitted", "said"),
    [
        *((dict.fromkeys([name]), None, f"^{name} is not set") for name in ("CLASSROOM", "COMMIT_URL")),
        ({"SUBMISSION_TAG": "submit/v1"}, None, "--submitted-at"),
        ({}, "2026-06-01T14:32:01", "has no time zone"),
    ],
)
def test_classroom50_names_what_is_missing(
    changes: dict[str, str | None], submitted: str | None, said: str
) -> None:
    environment = {name: value for name, value in (RUNNER | changes).items() if value is not None}
    with pytest.raises(ExportError, match=said):
        classroom50.export(result(tried(), submitted=submitted), None, environment)
