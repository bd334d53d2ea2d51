"""Hard cases: ellipsoids."""

from renderer.hard_cases.cases import Section

SECTION = Section("Ellipsoids")
