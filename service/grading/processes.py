"""Calls in processes of their own, some at a time; each has its deadline and its memory, and dies alone."""

from __future__ import annotations

import multiprocessing
import os
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
        Without arguments; it, its result and what it raises must be picklable.
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
        What it gave; None where it gave nothing.
    error : Exception or None
        What it raised.
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

    @property
    def ends(self) -> float:
        return self.begun + self.errand.deadline


def run_all(errands: Sequence[Errand], jobs: int) -> Iterator[tuple[str, Finished]]:
    """Do errands, so many at a time, and give each by its name as soon as it is finished.

    When the caller stops asking, those that still run are ended.
    """
    # Several of them share the cores already.
    for name in ONE_THREAD:
        os.environ.setdefault(name, "1")
    context = multiprocessing.get_context("forkserver")
    # The libraries are loaded once, and each process begins with them.
    context.set_forkserver_preload([child.__name__, "service.grading.kinds"])
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
                if here in ready or now >= one.ends:
                    del running[here]
                    yield one.errand.name, _finished(here, one, answered=here in ready)
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


def _finished(here: Connection, one: _Running, *, answered: bool) -> Finished:
    seconds = time.monotonic() - one.begun
    try:
        if not answered:
            return Finished(trouble=f"It was given up after {one.errand.deadline:g} s.", seconds=seconds)
        result, error, cpu_seconds = here.recv()
        return Finished(result, error, seconds=seconds, cpu_seconds=cpu_seconds)
    except (EOFError, OSError):
        return Finished(trouble=_died(one), seconds=seconds)
    finally:
        _end(here, one)


def _died(one: _Running) -> str:
    one.process.join()
    memory = one.errand.memory
    perhaps = "perhaps for lack of memory" if memory is None else f"with {memory // MEBIBYTE} MiB of memory"
    return f"Its process died (exit code {one.process.exitcode}), {perhaps}."


def _end(here: Connection, one: _Running) -> None:
    one.process.kill()
    one.process.join()
    here.close()
