"""The result of grading a submission, from which all exports are derived."""

from __future__ import annotations

from typing import Any, Literal

from pydantic import ConfigDict, Field

from schemas.api.comparisons import ComparisonCause, ComparisonRegion
from schemas.base import Message

Status = Literal["passed", "partial", "failed", "error", "not_gradable", "skipped"]
Feedback = Literal["none", "verdict", "difference", "picture"]
"""Levels of detail that students see of a test; each includes those before it."""

GradeVerdict = Literal["match", "noisy_match", "mismatch", "not_comparable"]


class GradeImage(Message):
    """A picture that explains a test."""

    label: str = Field(description="What it shows.")
    file: str = Field(description="PNG, in the folder of the result.")
    feedback: Literal["difference", "picture"] = Field(
        default="picture", description="Students see it where the test has this `feedback`."
    )


class Override(Message):
    """Points that staff gave a test by hand."""

    reason: str = Field(description="A sentence for the student.")
    points: float = Field(ge=0, description="Of the test before.")
    status: Status = Field(description="Of the test before.")


class Lateness(Message):
    """Points lost by a late submission."""

    deadline: str = Field(description="ISO 8601.")
    days: int = Field(ge=1, description="Days begun after the deadline.")
    points: float = Field(ge=0, description="Taken off the score.")


class TestGrade(Message):
    """The result of one test."""

    # pytest collects classes whose names begin with Test.
    __test__ = False

    id: str
    name: str
    kind: Literal["image", "scene", "rays", "time"]
    points: float = Field(
        ge=0, description="Earned. Where the status is `error` or `not_gradable` this 0 judges nothing."
    )
    max_points: float = Field(ge=0)
    bonus: bool = Field(default=False, description="Its points are not in the `max_score`.")
    status: Status = Field(
        description="All points (`passed`), some, none (`failed`); `skipped` where the file was not "
        "submitted; `not_gradable` where what was submitted cannot be compared; `error` where the test "
        "itself broke, was late, or lacks its reference."
    )
    hidden: bool = Field(default=False, description="Students do not see this test.")
    feedback: Feedback = Field(default="picture", description="What students see of it.")
    tags: tuple[str, ...] = ()
    override: Override | None = Field(default=None, description="Where staff gave the points.")
    message: str = Field(description="What decided, and what to do, for students.")
    verdict: GradeVerdict | None = Field(default=None, description="Of pictures.")
    metric: str | None = Field(default=None, description="What was compared with the threshold.")
    value: float | None = Field(default=None, description="The metric's value.")
    threshold: float | None = Field(default=None, description="The value that earns all points.")
    margin: float | None = Field(
        default=None,
        description="How far the value is on the good side of the threshold, as a share of the threshold.",
    )
    samples_to_settle: float | None = Field(
        default=None, description="With so many times the samples this difference would count as real."
    )
    metrics: dict[str, float | None] = Field(default={}, description="All numbers; null has no finite value.")
    diagnosis: tuple[ComparisonCause, ...] = Field(default=(), description="The best explanation first.")
    worst_regions: tuple[ComparisonRegion, ...] = Field(default=(), description="Worst first.")
    images: tuple[GradeImage, ...] = ()
    cpu_seconds: float = Field(default=0.0, ge=0, description="Of the test's own processes.")
    seconds: float = Field(default=0.0, ge=0, description="From its start to its end.")

    @property
    def is_open(self) -> bool:
        """Whether it could not be judged; its 0 points are a placeholder then."""
        return self.status in {"error", "not_gradable"}


class Signal(Message):
    """A hint for staff to look at a submission; it never costs points."""

    test: str = Field(description="Id of the test.")
    code: str = Field(description="A word for programs: `identical_bytes`, `closer_than_noise`.")
    message: str = Field(description="A sentence for staff.")


class GradeInput(Message):
    """A file that was read."""

    test: str = Field(description="Id of the test.")
    role: Literal["submission", "reference"]
    name: str = Field(description="Relative to its folder.")
    sha256: str | None = Field(description="Of the file; of the picture where it was rendered here.")
    content: str | None = Field(
        default=None,
        description="SHA-256 of the pixels, as shown with 16 bits, or of the arrays in the file, in whatever "
        "format they were saved.",
    )
    size: int | None = Field(description="Bytes of the file; null where it was rendered here.")
    width: int | None = Field(default=None, description="Pixels, of a picture.")
    height: int | None = Field(default=None, description="Pixels, of a picture.")
    encoding: Literal["srgb", "linear"] | None = Field(default=None, description="Of a picture.")
    samples: float | None = Field(default=None, description="Mean camera samples per pixel, if known.")


class GradeTool(Message):
    """The program that graded."""

    name: str = "penumbra"
    version: str


class GradeTimings(Message):
    """The duration of grading."""

    seconds: float = Field(ge=0)
    cpu_seconds: float = Field(ge=0, description="Of all processes, rendering on a server left out.")
    started: str = Field(description="UTC, ISO 8601.")


class Grade(Message):
    """The results of a submission."""

    model_config = ConfigDict(populate_by_name=True, serialize_by_alias=True)

    schema_: Literal["penumbra/grade/v1"] = Field(
        default="penumbra/grade/v1", alias="schema", description="The format of this document."
    )
    title: str = Field(description="Of the assignment.")
    student: str | None = Field(default=None, description="Whose submission it is, where known.")
    submitted: str | None = Field(default=None, description="Time of the submission, ISO 8601, where known.")
    own_scenes: bool = Field(
        default=False, description="Whether references show the scenes of this student alone."
    )
    gradable: bool = Field(description="Whether any test could be graded.")
    ungraded: tuple[str, ...] = Field(
        default=(), description="Ids of tests that are `error` or `not_gradable`: somebody should look."
    )
    verdict: GradeVerdict = Field(
        description="`not_comparable` where not a single test could be graded; `mismatch` where points were "
        "lost; `match` where all pictures equal their references but for rounding; else `noisy_match`."
    )
    score: float = Field(
        ge=0, description="Sum of all points, those of bonus tests too, less those lost by lateness."
    )
    max_score: float = Field(ge=0, description="Sum of all points but those of bonus tests.")
    late: Lateness | None = Field(
        default=None, description="Null if the submission is in time, or the manifest has no late policy."
    )
    tests: tuple[TestGrade, ...] = Field(description="In the order of the manifest.")
    signals: tuple[Signal, ...] = Field(default=(), description="For staff only.")
    inputs: tuple[GradeInput, ...] = Field(default=(), description="What was read.")
    policy: dict[str, dict[str, Any]] = Field(
        default={}, description="For each test, by id, what the manifest accepts."
    )
    tool: GradeTool
    timings: GradeTimings

    @property
    def is_open(self) -> bool:
        """Whether its score is not final; bonus points may stay open."""
        return any(test.is_open and not test.bonus for test in self.tests)

    @property
    def earned(self) -> float:
        """The points before those lost by lateness."""
        return self.score + (self.late.points if self.late else 0.0)
