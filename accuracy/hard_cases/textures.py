"""Hard cases: textures, normal maps, displacement."""

from accuracy.hard_cases import image_lookups, normal_maps, relief, relief_borders, texture_coordinates
from accuracy.hard_cases.cases import Section

PARTS = (image_lookups, texture_coordinates, normal_maps, relief, relief_borders)

SECTION = Section(
    "Textures, normal maps, displacement", [case for part in PARTS for case in part.SECTION.cases]
)
