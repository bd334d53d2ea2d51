"""Hard cases: cameras."""

from renderer.hard_cases.cases import Section

SECTION = Section("Cameras")
