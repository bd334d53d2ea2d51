"""What is wrong with a request, in words for people and names for programs."""

from __future__ import annotations

from pydantic import BaseModel, ConfigDict, Field


class Problem(BaseModel):
    """One thing that is wrong, or probably not meant, with its place and its cure."""

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
    instance: str | None = Field(default=None, description="The path that was asked for.")
    code: str | None = Field(default=None, description="The kind of problem, a word for programs.")
    errors: tuple[Problem, ...] = Field(default=(), description="All that is wrong, at most 50.")
    more: int = Field(default=0, ge=0, description="How many further errors are not listed.")
