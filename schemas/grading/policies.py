"""Policies of an assignment: what lateness costs, and how scenes differ from student to student."""

from __future__ import annotations

from datetime import datetime
from typing import Annotated

from pydantic import AfterValidator, Field
from pydantic_core import PydanticCustomError

from schemas.base import Closed


def _moment(text: str) -> str:
    try:
        aware = datetime.fromisoformat(text).tzinfo is not None
    except ValueError:
        aware = False
    if not aware:
        raise PydanticCustomError(
            "not_a_moment", "Write a time with its zone, ISO 8601, such as 2026-11-21T23:59:00+01:00."
        )
    return text


Moment = Annotated[str, Field(strict=True, max_length=64), AfterValidator(_moment)]
Share = Annotated[float, Field(strict=True, gt=0, le=1)]
Minutes = Annotated[float, Field(strict=True, ge=0, le=525600)]


class LatePolicy(Closed):
    """Points lost by a late submission: a share of the full score for each day begun after the deadline."""

    deadline: Moment = Field(description="ISO 8601, with its time zone.")
    per_day: Share = Field(description="Share of the full score that each day begun costs, 0 to 1.")
    most: Share = Field(default=1.0, description="The largest share that lateness costs.")
    grace: Minutes = Field(default=0.0, description="Minutes after the deadline that cost nothing.")
