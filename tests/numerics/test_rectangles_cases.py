"""The hard cases of rectangles."""

import pytest

from accuracy.hard_cases import Case
from accuracy.hard_cases.rectangles import SECTION
from tests.numerics.outcomes import holds


@pytest.mark.parametrize("case", SECTION.cases, ids=[case.name for case in SECTION.cases])
def test_rectangles_hold_in(case: Case) -> None:
    holds(case)
