"""The exceptions of reading.

ValueError
  SceneError    a document that is not a usable scene or request
"""

from __future__ import annotations

from collections.abc import Sequence

from schemas.problems import Problem

SHOWN = 50
"""How many problems are listed; the rest is counted."""


class SceneError(ValueError):
    """A document cannot be used.

    Parameters
    ----------
    problems
        All that is wrong, at least one.
    more
        How many problems are known beyond those given.

    Attributes
    ----------
    errors
        The first 50 problems, in the order of the document's fields.
    more
        How many further problems there are.
    """

    def __init__(self, problems: Sequence[Problem], more: int = 0) -> None:
        self.errors: tuple[Problem, ...] = tuple(problems[:SHOWN])
        self.more: int = more + len(problems) - len(self.errors)
        super().__init__(self.errors, self.more)

    def __str__(self) -> str:
        first = self.errors[0]
        others = len(self.errors) - 1 + self.more
        place = f"line {first.line}, column {first.column}: " if first.line else ""
        meant = f" Did you mean {first.suggestion!r}?" if first.suggestion else ""
        rest = f" (and {others} more)" if others else ""
        return f"{place}{first.pointer or 'document'}: {first.detail}{meant}{rest}"

    def __reduce__(self) -> tuple[type[SceneError], tuple[Sequence[Problem], int]]:
        return SceneError, (self.errors, self.more)
