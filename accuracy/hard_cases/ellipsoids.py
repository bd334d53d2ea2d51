"""Hard cases: ellipsoids."""

from accuracy.hard_cases import ellipsoid_hits, ellipsoid_limits, ellipsoid_normals, ellipsoid_touching
from accuracy.hard_cases.cases import Section

PARTS = (ellipsoid_hits, ellipsoid_touching, ellipsoid_normals, ellipsoid_limits)

SECTION = Section("Ellipsoids", [case for part in PARTS for case in part.SECTION.cases])
