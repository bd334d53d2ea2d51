"""Run calls in separate processes, each with a deadline and a memory limit."""

from __future__ import annotations

import multiprocessing
import os
import pickle
import resource
import sys
import threading
import time
from collections import deque
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from multiprocessing.connection import Connection, wait
from pathlib import Path
from typing import TYPE_CHECKING, Any

from renderer.workers import ONE_THREAD
from service.grading.errors import BrokenTestError

if TYPE_CHECKING:
    from multiprocessing.process import BaseProcess

MEBIBYTE = 1 << 20
STDOUT, STDERR = 1, 2


@dataclass(frozen=True, slots=True)
class Errand:
    """A call to run in a separate process.

    Attributes
    ----------
    call : callable
        Takes no arguments; the call, its results and its exceptions must be picklable. If it returns an
        iterator, each result replaces the previous one.
    deadline, memory : float, int or None
        Seconds, and bytes that the process may allocate; None for no limit.
    then : callable or None
        Maps its outcome to errands that follow it. They are run before any other that waits, and the outcome
        itself is not reported.
    cpu_seconds : float
        What an errand before it took, to be reported with its own.
    """

    name: str
    call: Callable[[], Any]
    deadline: float
    memory: int | None = None
    then: Callable[[Finished], Sequence[Errand]] | None = None
    cpu_seconds: float = 0.0


@dataclass(frozen=True, slots=True)
class Finished:
    """The outcome of an errand.

    Attributes
    ----------
    result : object
        Its last result before the deadline; None if there was none.
    error : Exception or None
        The exception it raised before any result, or one that says why there is neither.
    seconds, cpu_seconds : float
        CPU seconds are 0 if the process ended before it reported them.
    """

    result: Any = None
    error: Exception | None = None
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

    def finished(self, error: Exception | None) -> Finished:
        """The outcome; a result that arrived in time is kept, even if the process died afterwards."""
        error = error if self.result is None else None
        cpu_seconds = self.errand.cpu_seconds + self.cpu_seconds
        return Finished(self.result, error, time.monotonic() - self.begun, cpu_seconds)


def run_all(errands: Sequence[Errand], jobs: int) -> Iterator[tuple[str, Finished]]:
    """Run errands, `jobs` at a time, and yield each with its name as soon as it finishes.

    When the generator is closed, running errands are killed.
    """
    # The processes already share the cores.
    for name in ONE_THREAD:
        os.environ.setdefault(name, "1")
    context = multiprocessing.get_context("forkserver")
    # Load the libraries and the modules of this process once, in the fork server: each child imports the main
    # program again.
    context.set_forkserver_preload([name for name in sys.modules if name.startswith("service.")])
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
                finished = _received(here, one) if here in ready else _late(one, now)
                if finished is not None:
                    del running[here]
                    _end(here, one)
                    if one.errand.then is None:
                        yield one.errand.name, finished
                    else:
                        waiting.extendleft(reversed(one.errand.then(finished)))
    finally:
        for here, one in running.items():
            _end(here, one)


def _start(context: Any, errand: Errand) -> tuple[Connection, _Running]:
    here, there = context.Pipe(duplex=False)
    process = context.Process(target=_do, args=(there, errand.call, errand.memory), daemon=True)
    process.start()
    # Only the child holds the write end now, so the pipe closes when the child dies.
    there.close()
    return here, _Running(errand, process, time.monotonic())


def _received(here: Connection, one: _Running) -> Finished | None:
    """The outcome of an errand whose process sent a message; None if it continues."""
    try:
        has_ended, found, one.cpu_seconds = here.recv()
    except (EOFError, OSError):
        return one.finished(_died(one))
    if has_ended:
        return one.finished(found)
    one.result = found
    return None


def _late(one: _Running, now: float) -> Finished | None:
    if now < one.ends:
        return None
    return one.finished(BrokenTestError(f"It timed out after {one.errand.deadline:g} s."))


def _died(one: _Running) -> BrokenTestError:
    one.process.join()
    memory = one.errand.memory
    perhaps = "perhaps for lack of memory" if memory is None else f"with {memory // MEBIBYTE} MiB of memory"
    return BrokenTestError(f"Its process died (exit code {one.process.exitcode}), {perhaps}.")


def _end(here: Connection, one: _Running) -> None:
    one.process.kill()
    one.process.join()
    here.close()


def _do(answer: Connection, call: Callable[[], Any], memory: int | None) -> None:
    """Call a function and send back its results, at the end its exception or None, and CPU seconds with each.

    Parameters
    ----------
    call
        May return an iterator: each result is sent as it comes, and replaces the previous one.
    memory
        Bytes that this process may allocate beyond those of the program itself; None for no limit.
    """
    # Ctrl-C at a terminal goes to the parent, which ends this process.
    os.setsid()
    threading.Thread(target=_end_with_parent, daemon=True).start()
    # macOS refuses a limit below what every process has mapped from its start.
    if memory is not None and sys.platform == "linux":
        most = _taken() + memory
        resource.setrlimit(resource.RLIMIT_AS, (most, most))
    # Stdout carries nothing but the document of the command.
    os.dup2(STDERR, STDOUT)
    error = None
    try:
        given = call()
        for result in given if isinstance(given, Iterator) else (given,):
            answer.send((False, result, time.process_time()))
    except Exception as raised:  # noqa: BLE001 - any error fails this test alone
        error = _picklable(raised)
    answer.send((True, error, time.process_time()))


def _taken() -> int:
    """Bytes of address space of this process, mostly libraries that the parent has loaded."""
    return int(Path("/proc/self/statm").read_text().split()[0]) * resource.getpagesize()


def _picklable(error: Exception) -> Exception:
    try:
        pickle.loads(pickle.dumps(error))  # noqa: S301 - pickled in this process
    except Exception:  # noqa: BLE001 - pickling foreign exceptions may raise anything
        return RuntimeError(f"{type(error).__name__}: {error}")
    return error


def _end_with_parent() -> None:
    parent = multiprocessing.parent_process()
    if parent is not None:
        parent.join()
        os._exit(1)
