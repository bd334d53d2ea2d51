"""What every hard case has to show."""

from accuracy.hard_cases import Case


def holds(case: Case) -> None:
    """Something was tried, nothing is wrong, and the textbook formula, if any, is wrong somewhere."""
    outcome = case.run()
    assert outcome.tried > 0
    assert outcome.wrong == 0
    textbook = [count for count in (outcome.textbook, outcome.textbook_single) if count is not None]
    assert not textbook or max(textbook) > 0
