"""Export a native result to the formats of platforms: pure functions of the result and its pictures."""

from collections.abc import Callable

from service.grading.errors import ExportError
from service.grading.exports import (
    classroom50,
    gradebook,
    gradescope,
    junit,
    markdown,
    page,
    prairielearn,
)

EXPORTS: dict[str, Callable[..., bytes]] = {
    "gradescope": gradescope.export,
    "prairielearn": prairielearn.export,
    "classroom50": classroom50.export,
    "junit": junit.export,
    "csv": gradebook.for_gradebook,
    "csv-staff": gradebook.with_signals,
    "markdown": markdown.export,
    "html": page.for_reading,
    "html-staff": page.for_staff_review,
}
"""By format: functions of a `schemas.grading.grades.Grade` and the folder of its pictures or None."""

__all__ = ["EXPORTS", "ExportError"]
