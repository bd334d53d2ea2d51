"""Hard cases: trees of boxes, mirrors and glass."""

from renderer.hard_cases import bounces, mirror_rooms, trees
from renderer.hard_cases.cases import Section

PARTS = (trees, bounces, mirror_rooms)

SECTION = Section("Trees, mirrors and glass", [case for part in PARTS for case in part.SECTION.cases])
