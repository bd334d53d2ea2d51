"""Hard cases: samples, sums, output."""

from renderer.hard_cases.cases import Section

SECTION = Section("Samples, sums, output")
