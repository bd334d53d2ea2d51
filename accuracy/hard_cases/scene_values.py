"""Hard cases: values of a scene, its units, and what its picture must not depend on."""

from accuracy.hard_cases import fused_products, same_pictures, written_values
from accuracy.hard_cases.cases import Section

SECTION = Section(
    "Scene values and units",
    [*written_values.SECTION.cases, *same_pictures.SECTION.cases, *fused_products.SECTION.cases],
)
