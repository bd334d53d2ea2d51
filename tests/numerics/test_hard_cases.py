"""Every hard case of every section, and the catalogue that they are numbered by."""

import pytest

from accuracy.hard_cases import Case, sections

CATALOGUE = {"A": 7, "B": 14, "C": 8, "D": 15, "E": 13, "F": 7, "G": 10, "H": 9, "I": 9, "J": 11}
"""How many hard cases each section of the catalogue lists."""

CASES = [case for section in sections() for case in section.cases]


@pytest.mark.parametrize("case", CASES, ids=lambda case: f"{case.ids[0]} {case.name}")
def test_the_renderer_is_right_where_plain_formulas_are_not(case: Case) -> None:
    outcome = case.run()
    assert outcome.tried > 0
    assert outcome.wrong == 0
    textbook = [count for count in (outcome.textbook, outcome.textbook_single) if count is not None]
    assert not textbook or max(textbook) > 0


def test_each_section_has_the_letter_of_its_place() -> None:
    letters = [{each[0] for case in section.cases for each in case.ids} for section in sections()]
    assert letters == [{letter} for letter in CATALOGUE]


@pytest.mark.parametrize(("letter", "listed"), CATALOGUE.items())
def test_every_number_of_the_catalogue_has_a_case_and_later_ones_leave_no_gap(
    letter: str, listed: int
) -> None:
    numbers = sorted({int(each[1:]) for case in CASES for each in case.ids if each[0] == letter})
    assert numbers == list(range(1, max(listed, *numbers) + 1))
