"""Hard cases D: ellipsoids."""

from accuracy.hard_cases.ellipsoids import hits, surfaces
from accuracy.hard_cases.harness import gathered

SECTION = gathered("Ellipsoids", hits.SECTION, surfaces.SECTION)
