"""Runs the hard cases, in one process or several, and keeps the outcome of each."""

from __future__ import annotations

import time
import traceback
from collections import deque
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

from accuracy.hard_cases import Case, Outcome, Section, sections
from renderer.workers import Workers

Place = tuple[int, int]
"""Number of a section, and of a case in it."""


@dataclass(frozen=True, slots=True)
class Trial:
    """The result of one case.

    Attributes
    ----------
    section : str
    ids : tuple of str
        The case's numbers in the catalogue, such as A1.
    case : str
    outcome : Outcome or None
        None where the case broke off.
    error : str
        What it broke off with, and where; empty where it did not.
    seconds : float
        CPU time, which other programs do not affect.
    """

    section: str
    ids: tuple[str, ...]
    case: str
    outcome: Outcome | None
    error: str
    seconds: float

    @property
    def right(self) -> bool:
        """Whether the case finished without a wrong answer."""
        return self.outcome is not None and self.outcome.wrong == 0


def attempt(section: Section, case: Case) -> Trial:
    """Run one case; errors become part of the trial, so that the others still run."""
    begun = time.process_time()
    outcome, error = None, ""
    try:
        outcome = case.run()
    except Exception as raised:  # noqa: BLE001 - a case that breaks off is an answer too: it is wrong
        error = _described(raised)
    return Trial(section.title, case.ids, case.name, outcome, error, time.process_time() - begun)


def one_after_another(catalogue: Iterable[Section]) -> Iterator[Trial]:
    """Try all cases in this process."""
    return (attempt(section, case) for section in catalogue for case in section.cases)


def in_processes(places: Sequence[Place], workers: int) -> Iterator[Trial]:
    """Try cases of the catalogue in several processes, in the order of `places`; RenderError if one dies."""
    early: dict[Place, Trial] = {}
    order = deque(places)
    with Workers(workers, _attempt_numbered) as crew:
        for place, trial in crew.each(places):
            early[place] = trial
            while order and order[0] in early:
                yield early.pop(order.popleft())


def places_of(catalogue: Iterable[Section]) -> list[Place]:
    """Where all cases of a catalogue are, in its order."""
    return [(s, c) for s, section in enumerate(catalogue) for c in range(len(section.cases))]


def _attempt_numbered(place: Place) -> Trial:
    section = sections()[place[0]]
    return attempt(section, section.cases[place[1]])


def _described(error: Exception) -> str:
    place = traceback.extract_tb(error.__traceback__)[-1]
    return f"{type(error).__name__}: {error} ({Path(place.filename).name}, line {place.lineno})"
