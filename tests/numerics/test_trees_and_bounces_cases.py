"""Every hard case of trees, mirrors and glass."""

import pytest

from accuracy.hard_cases import Case
from accuracy.hard_cases.trees_and_bounces import SECTION
from tests.numerics.outcomes import holds


@pytest.mark.parametrize("case", SECTION.cases, ids=lambda case: case.name)
def test_the_renderer_is_right_where_plain_formulas_are_not(case: Case) -> None:
    holds(case)
