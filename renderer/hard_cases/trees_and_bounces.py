"""Hard cases: trees, mirrors, glass."""

from renderer.hard_cases.cases import Section

SECTION = Section("Trees, mirrors, glass")
