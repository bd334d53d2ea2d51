"""Calls in processes of their own, some at a time; each has its deadline and its memory, and dies alone."""

from __future__ import annotations

import multiprocessing
import os
import sys
import time
from collections import deque
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from multiprocessing.connection import Connection, wait
from typing import TYPE_CHECKING, Any

from renderer.workers import ONE_THREAD
from service.grading import child

if TYPE_CHECKING:
    from multiprocessing.process import BaseProcess

MEBIBYTE = 1 << 20


@dataclass(frozen=True, slots=True)
class Errand:
    """Something to be done in a process of its own.

    Attributes
    ----------
    name : str
    call : callable
        Without arguments; it, what it gives and what it raises must be picklable. If it gives an iterator,
        each result takes the place of the one before.
    deadline : float
        Seconds.
    memory : int or None
        Bytes that the process may take.
    """

    name: str
    call: Callable[[], Any]
    deadline: float
    memory: int | None = None


@dataclass(frozen=True, slots=True)
class Finished:
    """What became of an errand.

    Attributes
    ----------
    result : object
        What it gave last in time; None where it gave nothing.
    error : Exception or None
        What it raised before it gave anything.
    trouble : str or None
        Why there is neither, a sentence.
    seconds, cpu_seconds : float
        CPU seconds are 0 where the process could not tell them any more.
    """

    result: Any = None
    error: Exception | None = None
    trouble: str | None = None
    seconds: float = 0.0
    cpu_seconds: float = 0.0


@dataclass(slots=True)
class _Running:
    errand: Errand
    process: BaseProcess
    begun: float
    result: Any = None
    cpu_seconds: float = 0.0

    @property
    def ends(self) -> float:
        return self.begun + self.errand.deadline

    def finished(self, *, error: Exception | None = None, trouble: str | None = None) -> Finished:
        """What became of it; a result that was there in time stays, whatever came after."""
        if self.result is not None:
            error = trouble = None
        return Finished(self.result, error, trouble, time.monotonic() - self.begun, self.cpu_seconds)


def run_all(errands: Sequence[Errand], jobs: int) -> Iterator[tuple[str, Finished]]:
    """Do errands, so many at a time, and give each by its name as soon as it is finished.

    When the caller stops asking, those that still run are ended.
    """
    # Several of them share the cores already.
    for name in ONE_THREAD:
        os.environ.setdefault(name, "1")
    context = multiprocessing.get_context("forkserver")
    # The libraries are loaded once, and each process begins with them; what this one has loaded, too, for
    # each looks at the program that it was started from.
    loaded = [name for name in sys.modules if name.startswith("service.")]
    context.set_forkserver_preload([child.__name__, "service.grading.kinds", *loaded])
    waiting, running = deque(errands), dict[Connection, _Running]()
    try:
        while waiting or running:
            while waiting and len(running) < jobs:
                here, one = _start(context, waiting.popleft())
                running[here] = one
            soonest = min(one.ends for one in running.values())
            ready = wait([*running], max(0.0, soonest - time.monotonic()))
            now = time.monotonic()
            for here, one in list(running.items()):
                finished = _heard(here, one) if here in ready else _late(one, now)
                if finished is not None:
                    del running[here]
                    _end(here, one)
                    yield one.errand.name, finished
    finally:
        for here, one in running.items():
            _end(here, one)


def _start(context: Any, errand: Errand) -> tuple[Connection, _Running]:
    here, there = context.Pipe(duplex=False)
    process = context.Process(target=child.do, args=(there, errand.call, errand.memory), daemon=True)
    process.start()
    # The process alone holds it now: when that dies, the pipe ends.
    there.close()
    return here, _Running(errand, process, time.monotonic())


def _heard(here: Connection, one: _Running) -> Finished | None:
    """What became of an errand whose process has said something; None if it goes on."""
    try:
        told = here.recv()
    except (EOFError, OSError):
        return one.finished(trouble=_died(one))
    if isinstance(told, child.Ended):
        one.cpu_seconds = told.cpu_seconds
        return one.finished(error=told.error)
    one.result, one.cpu_seconds = told
    return None


def _late(one: _Running, now: float) -> Finished | None:
    if now < one.ends:
        return None
    return one.finished(trouble=f"It was given up after {one.errand.deadline:g} s.")


def _died(one: _Running) -> str:
    one.process.join()
    memory = one.errand.memory
    perhaps = "perhaps for lack of memory" if memory is None else f"with {memory // MEBIBYTE} MiB of memory"
    return f"Its process died (exit code {one.process.exitcode}), {perhaps}."


def _end(here: Connection, one: _Running) -> None:
    one.process.kill()
    one.process.join()
    here.close()
