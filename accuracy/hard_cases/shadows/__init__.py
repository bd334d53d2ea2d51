"""Hard cases E: shadows and light."""

from accuracy.hard_cases.harness import gathered
from accuracy.hard_cases.shadows import lights, lit_places, occluders, seams

PARTS = (occluders, seams, lights, lit_places)

SECTION = gathered("Shadows and light", *(part.SECTION for part in PARTS))
