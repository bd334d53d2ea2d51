"""Hard cases: rectangles."""

from renderer.hard_cases.cases import Section

SECTION = Section("Rectangles")
