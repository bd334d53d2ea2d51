"""Conditions of partial indices: a statement that is to use one has its condition, word for word."""

from __future__ import annotations

WAITS_TO_START = "state = 'queued' AND paused_at IS NULL"
"""Jobs with a place in the queue."""
HAS_PICTURE = "state = 'succeeded' AND NOT pinned"
"""Jobs that lose their picture when they are old enough."""
MAY_BE_FORGOTTEN = "finished_at IS NOT NULL AND NOT pinned"
"""Jobs that are deleted when they are old enough."""
UNMEASURED = "state = 'succeeded' AND stored_bytes IS NULL"
"""Renders of an earlier version, whose picture sizes are not in the database."""
WITH_ERROR = "target_error IS NOT NULL AND image_sha256 IS NOT NULL"
"""Renders with an error that can be compared with the one requested."""
