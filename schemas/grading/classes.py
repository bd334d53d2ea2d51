"""The result of grading a class: a line for each submission, and similarities between submissions."""

from __future__ import annotations

from typing import Literal

from pydantic import ConfigDict, Field

from schemas.base import Message
from schemas.grading.grades import GradeVerdict, Lateness, Signal


class SharedFiles(Message):
    """Submissions with equal files: the same pixels or arrays, or else the same bytes."""

    students: tuple[str, ...] = Field(description="Whose submissions they are, by name.")
    tests: tuple[str, ...] = Field(description="Ids of the tests whose files are the same.")


class SharedNoise(Message):
    """Submissions whose pictures have the same noise, though not the same pixels."""

    students: tuple[str, ...] = Field(description="Whose submissions they are, by name.")
    tests: tuple[str, ...] = Field(description="Ids of the tests whose pictures have it.")
    correlation: float = Field(
        ge=-1, le=1, description="The lowest correlation of their noise that was detected."
    )


class NotCompared(Message):
    """Pictures whose noise was not compared with others."""

    test: str = Field(description="Id of the test.")
    reason: str = Field(description="A sentence for staff.")
    students: tuple[str, ...] = Field(description="Whose pictures they are, by name.")


class ClassEntry(Message):
    """One submission."""

    student: str = Field(description="The name of its folder.")
    folder: str = Field(description="Where its result is, as a relative address; bytes are percent-encoded.")
    score: float = Field(ge=0, description="As in the result of the submission.")
    gradable: bool = Field(description="Whether any test could be graded.")
    ungraded: tuple[str, ...] = Field(default=(), description="Ids of tests that could not be graded.")
    verdict: GradeVerdict
    late: Lateness | None = Field(default=None, description="Points lost by lateness.")
    overridden: tuple[str, ...] = Field(default=(), description="Ids of tests whose points staff set.")
    signals: tuple[Signal, ...] = Field(default=(), description="For staff only.")


class ClassGrade(Message):
    """The results of a class, for staff only."""

    model_config = ConfigDict(populate_by_name=True, serialize_by_alias=True)

    schema_: Literal["penumbra/class/v1"] = Field(
        default="penumbra/class/v1", alias="schema", description="The format of this document."
    )
    title: str = Field(description="Of the assignment.")
    max_score: float = Field(ge=0, description="Sum of all points but those of bonus tests.")
    students: tuple[ClassEntry, ...] = Field(description="By name.")
    shared_files: tuple[SharedFiles, ...] = Field(default=(), description="Most files in common first.")
    shared_noise: tuple[SharedNoise, ...] = Field(default=(), description="Most pictures in common first.")
    not_compared: tuple[NotCompared, ...] = Field(
        default=(), description="Pictures in which shared noise cannot be detected."
    )
    left_out: tuple[str, ...] = Field(
        default=(), description="Files in the folder of the class that belong to no submission, by name."
    )
