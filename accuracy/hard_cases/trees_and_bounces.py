"""Hard cases: trees of boxes, mirrors and glass."""

from accuracy.hard_cases import bounces, mirror_rooms, same_plane, trees
from accuracy.hard_cases.cases import Section

PARTS = (trees, same_plane, bounces, mirror_rooms)

SECTION = Section("Trees, mirrors and glass", [case for part in PARTS for case in part.SECTION.cases])
