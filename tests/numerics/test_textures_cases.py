"""Textures, normal maps and displacement, each case against exact answers."""

import pytest

from accuracy.hard_cases import Case
from accuracy.hard_cases.textures import SECTION
from tests.numerics.outcomes import holds


@pytest.mark.parametrize("case", SECTION.cases, ids=lambda case: case.name)
def test_hard_case(case: Case) -> None:
    holds(case)
