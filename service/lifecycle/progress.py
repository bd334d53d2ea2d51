"""How far a render is, and how long the rest is expected to take."""

from __future__ import annotations

from renderer.adaptive.forecast import MOST, seconds_left, share_by
from schemas.jobs import JobState
from service.lifecycle import pausing, rows
from service.storage.database.models import RenderRow

NO_LIMIT = float("inf")


def share(render: RenderRow) -> float:
    """Say which part of a render is done, 0 to 1.

    With target quality it is 1 when the picture is there; a time limit that is spent ends it, too.
    """
    done = rows.share(render)
    if render.target_error is None or render.state == JobState.SUCCEEDED:
        return done
    if render.state != JobState.RUNNING or render.started_at is None:
        return min(done, MOST)
    return share_by(done, pausing.ran_for(render), render.time_limit or NO_LIMIT)


def remaining_seconds(render: RenderRow) -> float | None:
    """Say in how many seconds a render will be finished, None if it does not run or nothing is known."""
    if render.state != JobState.RUNNING or render.started_at is None or render.paused_at is not None:
        return None
    return seconds_left(share(render), pausing.ran_for(render), render.time_limit or NO_LIMIT)
