"""What a converter decided in place of the person who wrote the input."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict, dataclass, field, replace
from typing import Any, Literal

from schemas.findings import located
from schemas.problems import Problem

Kind = Literal["assumed", "left_out"]


@dataclass(frozen=True, slots=True)
class Assumption:
    """One decision.

    Attributes
    ----------
    kind
        Whether something was `assumed`, or `left_out` because scenes have nothing like it.
    file
        The file that it is about.
    place
        Where in it: a JSON pointer, or the words of an OBJ or MTL file. Empty for the whole file.
    line
        The line, from 1, where the file has lines.
    detail
        What was decided, and what to do where that is not meant.
    """

    kind: Kind
    file: str
    place: str
    line: int | None
    detail: str

    def as_document(self) -> dict[str, Any]:
        """The same for a program."""
        return asdict(self)


@dataclass(slots=True)
class Notes:
    """A list that grows while a file is converted; `file` is the one that most of it is about."""

    file: str
    taken: list[Assumption] = field(default_factory=list)

    def assume(self, place: str, detail: str, *, line: int | None = None, file: str = "") -> None:
        """Note that something was assumed."""
        self._add(Assumption("assumed", file or self.file, place, line, detail))

    def leave_out(self, place: str, detail: str, *, line: int | None = None, file: str = "") -> None:
        """Note that something was left out."""
        self._add(Assumption("left_out", file or self.file, place, line, detail))

    def _add(self, assumption: Assumption) -> None:
        if assumption not in self.taken:
            self.taken.append(assumption)

    def find_lines(self, text: str | None) -> None:
        """Give those about the file itself, a JSON text, their lines."""
        about = [number for number, note in enumerate(self.taken) if note.file == self.file]
        places = [Problem(pointer=self.taken[number].place, detail="", code="") for number in about]
        for number, place in zip(about, located(text, places), strict=True):
            self.taken[number] = replace(self.taken[number], line=place.line)


def grouped(assumptions: Sequence[Assumption]) -> list[tuple[Assumption, int]]:
    """The first of all that say the same about one file, with how many others there are."""
    counts: dict[tuple[str, str, str], list[Assumption]] = {}
    for assumption in assumptions:
        counts.setdefault((assumption.kind, assumption.file, assumption.detail), []).append(assumption)
    return [(same[0], len(same) - 1) for same in counts.values()]
