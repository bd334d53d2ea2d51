"""The Phong model at the ends of its numbers, each case against exact answers."""

import pytest

from accuracy.hard_cases import Case
from accuracy.hard_cases.phong import SECTION
from tests.numerics.outcomes import holds


@pytest.mark.parametrize("case", SECTION.cases, ids=lambda case: case.name)
def test_hard_case(case: Case) -> None:
    holds(case)
