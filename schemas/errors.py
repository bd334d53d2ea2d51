"""Problems with a request: sentences for people and codes for programs.

ValueError
  SceneError    a document that is not a usable scene or request
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import get_args

from pydantic import BaseModel, ConfigDict, Field
from pydantic_core.core_schema import ErrorType


class Problem(BaseModel):
    """A mistake, or a probable one, with its place and its cure."""

    model_config = ConfigDict(frozen=True, extra="ignore")

    pointer: str = Field(description="JSON Pointer (RFC 6901) into the document as the user sent it.")
    detail: str = Field(description="What is wrong and what to do, a sentence for people.")
    code: str = Field(description="What is wrong, a word for programs.")
    suggestion: str | None = Field(default=None, description="What was probably meant.")
    line: int | None = Field(default=None, ge=1, description="Line in the document, from 1.")
    column: int | None = Field(default=None, ge=1, description="Character in the line, from 1.")


class ProblemDocument(BaseModel):
    """A problem document (RFC 9457), `application/problem+json`: the body of every error answer."""

    model_config = ConfigDict(frozen=True, extra="ignore")

    type: str = Field(default="about:blank", description="A URI reference that names the kind of problem.")
    title: str = Field(description="The kind of problem in a few words.")
    status: int = Field(ge=400, le=599, description="The HTTP status.")
    detail: str | None = Field(default=None, description="What is wrong and what to do.")
    instance: str | None = Field(default=None, description="The requested path.")
    code: str | None = Field(default=None, description="The kind of problem, a word for programs.")
    errors: tuple[Problem, ...] = Field(default=(), description="All problems, at most 50.")
    more: int = Field(default=0, ge=0, description="How many further errors are not listed.")


BUILT_IN: frozenset[str] = frozenset(get_args(ErrorType))
"""Pydantic's own error types."""

MAX_LISTED = 50
"""Problems in one answer; further ones are only counted."""


class SceneError(ValueError):
    """A document cannot be used.

    Parameters
    ----------
    problems
        At least one.
    more
        Number of problems beyond those given.

    Attributes
    ----------
    errors
        The first 50 problems, in the order of the document's fields.
    more
        Number of further problems.
    """

    def __init__(self, problems: Sequence[Problem], more: int = 0) -> None:
        self.errors: tuple[Problem, ...] = tuple(problems[:MAX_LISTED])
        self.more: int = more + len(problems) - len(self.errors)
        super().__init__(self.errors, self.more)

    def __str__(self) -> str:
        first = self.errors[0]
        others = len(self.errors) - 1 + self.more
        place = f"line {first.line}, column {first.column}: " if first.line else ""
        meant = f" Did you mean {first.suggestion!r}?" if first.suggestion else ""
        rest = f" (and {others} more)" if others else ""
        return f"{place}{first.pointer or 'document'}: {first.detail}{meant}{rest}"

    def __reduce__(self) -> tuple[type[SceneError], tuple[Sequence[Problem], int]]:
        return SceneError, (self.errors, self.more)
