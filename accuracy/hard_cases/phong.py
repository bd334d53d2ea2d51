"""Hard cases: the Phong model."""

from accuracy.hard_cases import highlights, shading_normals
from accuracy.hard_cases.cases import Section

SECTION = Section("The Phong model", [*highlights.SECTION.cases, *shading_normals.SECTION.cases])
