"""What a hard case is, and what comes out of trying it."""

from collections.abc import Callable, Iterable
from dataclasses import dataclass, field


@dataclass(frozen=True, slots=True)
class Outcome:
    """What came of trying a case.

    Attributes
    ----------
    tried : int
        Answers looked at: rays, points, pixels or inputs.
    wrong : int
        Wrong answers of the renderer.
    textbook, textbook_single : int or None
        Wrong answers of the textbook formula to the same questions, in float64 and in float32; None where
        it was not asked. A case without any asks what to accept or refuse, for which there is no formula.
    worst : float or None
        Largest error among the right answers, in shares of what the case allows: at most 1.
    """

    tried: int
    wrong: int
    textbook: int | None = None
    textbook_single: int | None = None
    worst: float | None = None


def total(outcomes: Iterable[Outcome]) -> Outcome:
    """Several outcomes of one case as one."""
    parts = list(outcomes)
    return Outcome(
        tried=sum(part.tried for part in parts),
        wrong=sum(part.wrong for part in parts),
        textbook=_sum(part.textbook for part in parts),
        textbook_single=_sum(part.textbook_single for part in parts),
        worst=max((part.worst for part in parts if part.worst is not None), default=None),
    )


def _sum(counts: Iterable[int | None]) -> int | None:
    known = [count for count in counts if count is not None]
    return sum(known) if known else None


@dataclass(frozen=True, slots=True)
class Case:
    """One hard case.

    Attributes
    ----------
    name : str
        In words.
    symptom, cause, remedy, expected, source : str
        What users see where it goes wrong; why plain code fails; what is done here; what counts as right,
        with its tolerance; where the remedy comes from. One sentence or two each.
    run : callable
        Tries the case.
    """

    name: str
    symptom: str
    cause: str
    remedy: str
    expected: str
    source: str
    run: Callable[[], Outcome]


@dataclass(frozen=True, slots=True)
class Section:
    """Cases that belong together.

    Attributes
    ----------
    title : str
    cases : list of Case
    """

    title: str
    cases: list[Case] = field(default_factory=list)

    def case(
        self, name: str, *, symptom: str, cause: str, remedy: str, expected: str, source: str
    ) -> Callable[[Callable[[], Outcome]], Callable[[], Outcome]]:
        """Make a function the case `name` of this section; parameters as for `Case`."""

        def add(run: Callable[[], Outcome]) -> Callable[[], Outcome]:
            self.cases.append(Case(name, symptom, cause, remedy, expected, source, run))
            return run

        return add
