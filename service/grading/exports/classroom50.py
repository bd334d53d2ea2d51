"""``result.json`` of a Classroom 50 autograder.

Fields: https://github.com/foundation50/classroom50/wiki/Advanced-Autograding#the-resultjson-contract
"""

from __future__ import annotations

import math
import os
import re
from collections.abc import Mapping
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

from schemas.grading.grades import Grade
from service.grading.errors import ExportError
from service.grading.exports.rows import Row, for_students
from service.grading.exports.texts import encoded

REQUIRED = {
    "classroom": "CLASSROOM",
    "assignment": "ASSIGNMENT",
    "submission": "SUBMISSION_TAG",
    "commit": "COMMIT_URL",
    "release": "RELEASE_URL",
}
"""Variables that the runner of Classroom 50 sets, by field."""

STAMPED = {"assignment_type": "ASSIGNMENT_TYPE", "owner": "OWNER"}
"""Variables of optional fields; the runner writes a missing field itself."""

TAG_MOMENT = re.compile(r"^submit/(\d{4}-\d{2}-\d{2})T(\d{2})-(\d{2})-(\d{2})Z")


def export(grade: Grade, _pictures: Path | None = None, environment: Mapping[str, str] = os.environ) -> bytes:
    """Export a result for Classroom 50.

    Points of each test are rounded to whole numbers, halves up. Classroom 50 has no bonus, so bonus points
    count in `max-score` too. Pictures are not supported.

    Raises
    ------
    ExportError
        As `stamp` does.
    """
    tests = [_test(row) for row in for_students(grade)]
    return encoded(
        {"schema": "classroom50/result/v1"}
        | stamp(grade.submitted, environment)
        | {
            "score": sum(test["score"] for test in tests),
            "max-score": sum(test["max-score"] for test in tests),
            "tests": tests,
        }
    )


def stamp(submitted: str | None, environment: Mapping[str, str] = os.environ) -> dict[str, str]:
    """The fields that say whose submission it is, and of when.

    Parameters
    ----------
    submitted
        Time of the submission, ISO 8601; by default that of its tag.
    environment
        Environment of the runner, which names the submission.

    Raises
    ------
    ExportError
        A variable is missing, or the time of the submission is unknown.
    """
    return (
        {field: _variable(environment, name) for field, name in REQUIRED.items()}
        | {field: environment[name] for field, name in STAMPED.items() if environment.get(name)}
        | {
            "review": environment.get("REVIEW_URL") or _variable(environment, "COMMIT_URL"),
            "datetime": _moment(submitted, environment),
        }
    )


def _variable(environment: Mapping[str, str], name: str) -> str:
    value = environment.get(name)
    if not value:
        raise ExportError(
            f"{name} is not set. The runner of Classroom 50 identifies the submission by environment "
            f"variables: {', '.join(REQUIRED.values())}."
        )
    return value


def _moment(submitted: str | None, environment: Mapping[str, str]) -> str:
    """The time of the submission, not of grading: it decides whether the submission is late."""
    if submitted is None:
        found = TAG_MOMENT.match(_variable(environment, "SUBMISSION_TAG"))
        if found is None:
            raise ExportError(
                "The time of the submission is unknown: SUBMISSION_TAG does not begin with "
                "submit/YYYY-MM-DDTHH-MM-SSZ. Give it with --submitted-at."
            )
        return "{}T{}:{}:{}Z".format(*found.groups())
    moment = datetime.fromisoformat(submitted)
    if moment.tzinfo is None:
        raise ExportError(f"{submitted} has no time zone. Give it as 2026-06-01T14:32:01Z.")
    return moment.astimezone(UTC).strftime("%Y-%m-%dT%H:%M:%SZ")


def _test(row: Row) -> dict[str, Any]:
    return {
        "test-name": row.name,
        "passed": row.status == "passed",
        "score": _whole(row.points),
        "max-score": _whole(row.max_points),
        "status": row.status,
        "message": row.message,
    }


def _whole(points: float) -> int:
    return math.floor(points + 0.5)
