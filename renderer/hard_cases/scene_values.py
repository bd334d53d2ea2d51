"""Hard cases: scene values and units."""

from renderer.hard_cases.cases import Section

SECTION = Section("Scene values and units")
