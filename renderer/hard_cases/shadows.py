"""Hard cases: shadows and light."""

from renderer.hard_cases.cases import Section

SECTION = Section("Shadows and light")
