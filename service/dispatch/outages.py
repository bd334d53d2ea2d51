"""Outages: times in which nothing could be rendered, which time limits do not count.

The service is away between its last sign of life and the next; the database, the disk and the workers may be
away while it lives.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable

from service.dispatch.leadership import LEASE_SECONDS, Term
from service.workers.tasks import AdvanceDone, ComposeDone, Outcome, Preempted, TileDone

_STORED = TileDone | Preempted | AdvanceDone | ComposeDone


class Outages:
    """Tells outages from time in which tasks could run.

    Parameters
    ----------
    has_workers
        Whether a task that is handed out now would be executed.

    Attributes
    ----------
    beating : bool
        Whether signs of life are given at regular intervals; without work they are not.
    """

    def __init__(self, has_workers: Callable[[], bool]) -> None:
        self._has_workers = has_workers
        self._had_workers = self._store_closed = self.beating = False

    def seconds(self, term: Term, *, was_away: bool) -> float:
        """Return how much of the time since the last sign of life was an outage: all of it or nothing.

        Parameters
        ----------
        was_away
            Whether this server did not lead, or could not use the database, since then.
        """
        had_workers, self._had_workers = self._had_workers, self._has_workers()
        # A sign of life this late means that the process was stopped, or the machine suspended.
        stopped = term.silent_seconds >= LEASE_SECONDS
        idle = stopped or self._store_closed or not (had_workers and self._had_workers)
        return term.silent_seconds if was_away or (self.beating and idle) else 0.0

    def note(self, outcomes: Iterable[Outcome], *, store_closed: bool) -> None:
        """Record whether the store accepts results; the next stored result reopens it."""
        stored = any(isinstance(outcome, _STORED) for outcome in outcomes)
        self._store_closed = store_closed or (self._store_closed and not stored)
