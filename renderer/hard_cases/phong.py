"""Hard cases: the Phong model."""

from renderer.hard_cases import highlights, shading_normals
from renderer.hard_cases.cases import Section

SECTION = Section("The Phong model", [*highlights.SECTION.cases, *shading_normals.SECTION.cases])
