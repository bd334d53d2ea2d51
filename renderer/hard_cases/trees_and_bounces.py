"""Hard cases: trees of boxes, mirrors and glass."""

from renderer.hard_cases import bounces, trees
from renderer.hard_cases.cases import Section

SECTION = Section("Trees, mirrors and glass", [*trees.SECTION.cases, *bounces.SECTION.cases])
