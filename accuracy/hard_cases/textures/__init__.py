"""Hard cases G: textures, normal maps and displacement."""

from accuracy.hard_cases.harness import gathered
from accuracy.hard_cases.textures import lookups, normal_maps, relief

PARTS = (lookups, normal_maps, relief)

SECTION = gathered("Textures, normal maps, displacement", *(part.SECTION for part in PARTS))
