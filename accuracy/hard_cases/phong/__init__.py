"""Hard cases F: the Phong model."""

from accuracy.hard_cases.harness import gathered
from accuracy.hard_cases.phong import highlights, normals

SECTION = gathered("The Phong model", highlights.SECTION, normals.SECTION)
