"""Hard cases: triangles."""

from renderer.hard_cases.cases import Section

SECTION = Section("Triangles")
