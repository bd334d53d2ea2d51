"""Hard cases: textures, normal maps, displacement."""

from renderer.hard_cases.cases import Section

SECTION = Section("Textures, normal maps, displacement")
