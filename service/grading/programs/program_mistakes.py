"""Mistakes of a program: each test charges them, or judges its picture without them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from service.grading.programs.program import Program


@dataclass(frozen=True, slots=True)
class ProgramMistake:
    """A mistake that a program makes in all its pictures.

    Attributes
    ----------
    kind : str
        One of `service.grading.programs.program.KINDS`.
    cause, hint : str
    shows : frozenset of str
        Ids of tests in whose pictures it shows.
    charged : tuple of str
        Ids of tests in which it costs points, as the manifest lists them.
    """

    kind: str
    cause: str
    hint: str
    shows: frozenset[str]
    charged: tuple[str, ...]


@dataclass(frozen=True, slots=True)
class ProgramMistakes:
    """The mistakes of one program.

    Attributes
    ----------
    program : Program
        With all of them but missing anti-aliasing.
    found : tuple of ProgramMistake
    """

    program: Program
    found: tuple[ProgramMistake, ...]

    def charged(self, test_id: str) -> tuple[ProgramMistake, ...]:
        """Mistakes that cost points in a test."""
        return tuple(each for each in self.found if test_id in each.charged and test_id in each.shows)

    def undone(self, test_id: str) -> tuple[ProgramMistake, ...]:
        """Mistakes without which the picture of a test is judged."""
        return tuple(each for each in self.found if test_id in each.shows and test_id not in each.charged)

    def made(self, mistakes: Sequence[ProgramMistake]) -> Program:
        """A program that makes only these mistakes."""
        kept = {each.kind for each in mistakes}
        return self.program.without(*(kind for kind in self.program.kinds() if kind not in kept))


NONE = ProgramMistakes(Program(), ())
"""A program without mistakes of its own, or one of which nothing is known."""
