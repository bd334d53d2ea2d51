"""Hard cases: the Phong model."""

from renderer.hard_cases.cases import Section

SECTION = Section("The Phong model")
