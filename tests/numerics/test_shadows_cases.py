"""Hard cases of shadows and light."""

import pytest

from accuracy.hard_cases import Case
from accuracy.hard_cases.shadows import SECTION
from tests.numerics.outcomes import holds


@pytest.mark.parametrize("case", SECTION.cases, ids=lambda case: case.name)
def test_shadows_hold(case: Case) -> None:
    holds(case)
