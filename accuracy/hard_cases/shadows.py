"""Hard cases: shadows and light."""

from accuracy.hard_cases import lit_places, occluders, seams, shadow_lights, sharp_corners
from accuracy.hard_cases.cases import Section

PARTS = (occluders, sharp_corners, seams, shadow_lights, lit_places)

SECTION = Section("Shadows and light", [case for part in PARTS for case in part.SECTION.cases])
