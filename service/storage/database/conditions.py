"""Conditions of partial indices: a statement that is to use one has its condition, word for word."""

from __future__ import annotations

WAITS_TO_START = "state = 'queued' AND paused_at IS NULL"
"""Which jobs have a place in the queue."""
HAS_PICTURE = "state = 'succeeded' AND NOT pinned"
"""Which jobs lose their picture when they are old enough."""
MAY_BE_FORGOTTEN = "finished_at IS NOT NULL AND NOT pinned"
"""Which jobs are deleted when they are old enough."""
UNMEASURED = "state = 'succeeded' AND stored_bytes IS NULL"
"""Which renders have a picture whose size is not in the database: they ended under an earlier version."""
WITH_ERROR = "target_error IS NOT NULL AND image_sha256 IS NOT NULL"
"""Which renders have reached an error that can be compared with the one requested."""
