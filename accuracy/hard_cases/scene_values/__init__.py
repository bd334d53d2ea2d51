"""Hard cases J: values of a scene, its units, and what its picture must not depend on."""

from accuracy.hard_cases.harness import gathered
from accuracy.hard_cases.scene_values import pictures, values

SECTION = gathered("Scene values and units", values.SECTION, pictures.SECTION)
