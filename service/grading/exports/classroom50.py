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
from service.grading.export_errors import ExportError
from service.grading.exports.documents import encoded
from service.grading.exports.rows import Row, for_students

REQUIRED = {
    "classroom": "CLASSROOM",
    "assignment": "ASSIGNMENT",
    "submission": "SUBMISSION_TAG",
    "commit": "COMMIT_URL",
    "release": "RELEASE_URL",
}
"""Variables that the runner of Classroom 50 sets, by the fields that they are for."""

STAMPED = {"assignment_type": "ASSIGNMENT_TYPE", "owner": "OWNER"}
"""The same of fields that the runner writes itself where they are missing."""

TAG_MOMENT = re.compile(r"^submit/(\d{4}-\d{2}-\d{2})T(\d{2})-(\d{2})-(\d{2})Z")


def export(grade: Grade, pictures: Path | None = None, environment: Mapping[str, str] = os.environ) -> bytes:
    """A result in the form of Classroom 50.

    Points are rounded to whole numbers test by test, halves up. There is no bonus: its points are in the
    `max-score` too. Pictures have no place there.

    Parameters
    ----------
    environment
        Where the runner tells what it grades.

    Raises
    ------
    ExportError
        If it does not tell, or the moment of the submission is not known.
    """
    del pictures
    tests = [_test(row) for row in for_students(grade)]
    return encoded(
        {"schema": "classroom50/result/v1"}
        | {field: _told(environment, name) for field, name in REQUIRED.items()}
        | {field: environment[name] for field, name in STAMPED.items() if environment.get(name)}
        | {
            "review": environment.get("REVIEW_URL") or _told(environment, "COMMIT_URL"),
            "datetime": _moment(grade, environment),
            "score": sum(test["score"] for test in tests),
            "max-score": sum(test["max-score"] for test in tests),
            "tests": tests,
        }
    )


def _told(environment: Mapping[str, str], name: str) -> str:
    value = environment.get(name)
    if not value:
        raise ExportError(
            f"{name} is not set. Classroom 50 wants to know what was graded, and its runner tells it in the "
            f"environment: {', '.join(REQUIRED.values())}."
        )
    return value


def _moment(grade: Grade, environment: Mapping[str, str]) -> str:
    """When the submission was made, not when it was graded: lateness goes by it."""
    if grade.submitted is None:
        found = TAG_MOMENT.match(_told(environment, "SUBMISSION_TAG"))
        if found is None:
            raise ExportError(
                "The moment of the submission is not known: SUBMISSION_TAG does not begin with "
                "submit/YYYY-MM-DDTHH-MM-SSZ. Give it with --submitted-at."
            )
        return "{}T{}:{}:{}Z".format(*found.groups())
    moment = datetime.fromisoformat(grade.submitted)
    if moment.tzinfo is None:
        raise ExportError(f"{grade.submitted} has no time zone. Give it as 2026-06-01T14:32:01Z.")
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
