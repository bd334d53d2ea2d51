"""Hard cases: ellipsoids."""

from renderer.hard_cases import ellipsoid_hits
from renderer.hard_cases.cases import Section

SECTION = Section("Ellipsoids", [*ellipsoid_hits.SECTION.cases])
