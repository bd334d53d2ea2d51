"""Worker processes that run tasks in parallel; each of them, and this one, may be killed at any moment.

Every worker has a pipe of its own, and only the worker holds its far end. So a worker that dies in the middle
of an answer is an end of file here. In a pool with one queue for all answers this process would wait forever
for the rest of the answer, because it holds the writing end itself.
"""

import multiprocessing
import os
import signal
import sys
import threading
import time
import traceback
from collections import deque
from collections.abc import Callable, Iterable, Iterator
from contextlib import ExitStack, contextmanager, suppress
from multiprocessing import resource_tracker
from multiprocessing.connection import Connection, wait
from multiprocessing.reduction import ForkingPickler
from typing import TYPE_CHECKING, Any, Generic, Self, TypeVar

from renderer.errors import RenderError

if TYPE_CHECKING:
    from multiprocessing.process import BaseProcess

PIPE_BYTES = 4096
"""Bytes that a pipe takes in any case. Only so small a task is given to a worker that may be about to answer:
with a larger one both might wait for the other to read."""

Task = TypeVar("Task")
Result = TypeVar("Result")

Each = Callable[[Iterable[Task]], Iterator[tuple[Task, Result]]]
"""Runs tasks, and yields each with its result."""

TASKS_PER_WORKER = 2
"""Tasks given to a worker at once: the second one waits in its pipe, so that the worker is never idle."""

ONE_THREAD = ("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS", "MKL_NUM_THREADS")
"""Set to 1 for worker processes: they share the cores already."""

START_AFTER = 0.5
"""CPU seconds of tasks that this process runs before it starts workers: about what each of them costs to
start. So small pictures start none (64 x 48 pixels of gallery/basic: 1.1 CPU s in all instead of 2.9)."""

UNGUARDED_EXIT = 77
"""Exit status of a worker whose import of the user's script would start workers of its own."""


class Workers(Generic[Task, Result]):
    """A pool of worker processes.

    Use it in a ``with`` statement, which ends all of them, also during a task.

    Parameters
    ----------
    count : int
    do : callable
        Takes a task and gives its result. It is sent to each worker once, and so must be picklable, as must
        tasks, results and what it raises.
    """

    def __init__(self, count: int, do: Callable[[Task], Result]) -> None:
        _end_if_imported()
        for name in ONE_THREAD:
            os.environ.setdefault(name, "1")
        self._members: dict[Connection, BaseProcess] = {}
        try:
            with _unheard():
                for _ in range(count):
                    self._start(do)
        except BaseException:
            self.close()
            raise

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def each(self, tasks: Iterable[Task]) -> Iterator[tuple[Task, Result]]:
        """Run tasks, and yield each with its result as soon as it is done.

        A caller that stops before the last result must close the workers: they continue what they were given.

        Raises
        ------
        RenderError
            A worker process died.
        Exception
            Any error of `do`, with its traceback as a note.
        """
        waiting = deque((task, ForkingPickler.dumps(task)) for task in tasks)
        given: dict[Connection, deque[Task]] = {connection: deque() for connection in self._members}
        for connection in [*given] * TASKS_PER_WORKER:
            self._give(connection, given[connection], waiting)
        while busy := [connection for connection, held in given.items() if held]:
            wait(busy)
            for connection in filter(Connection.poll, busy):
                result: Result = self._received(connection)
                task = given[connection].popleft()
                self._give(connection, given[connection], waiting)
                yield task, result

    def close(self) -> None:
        """End all workers at once, without waiting for their tasks, which may take minutes."""
        for process in self._members.values():
            process.kill()
        for connection, process in self._members.items():
            process.join()
            connection.close()

    def _start(self, do: Callable[[Task], Result]) -> None:
        context = multiprocessing.get_context("spawn")
        here, there = context.Pipe()
        process = context.Process(target=_work, args=(there, do), daemon=True)
        process.start()
        # The worker alone holds it now, and it closes with the worker.
        there.close()
        self._members[here] = process

    def _give(
        self, connection: Connection, held: deque[Task], waiting: deque[tuple[Task, memoryview]]
    ) -> None:
        """Give a worker its next task, if there is one and sending it does not wait for the worker."""
        if not waiting or (held and len(waiting[0][1]) > PIPE_BYTES):
            return
        task, message = waiting.popleft()
        held.append(task)
        try:
            connection.send_bytes(message)
        except OSError:
            raise self._died(connection) from None

    def _received(self, connection: Connection) -> Any:
        try:
            done, answer = connection.recv()
        except (EOFError, OSError):
            raise self._died(connection) from None
        if not done:
            raise answer
        return answer

    def _died(self, connection: Connection) -> RenderError:
        process = self._members[connection]
        process.join(timeout=1)
        if process.exitcode == UNGUARDED_EXIT:
            return RenderError(
                "Each worker process imports this script, which would start workers again. "
                'Put the code that renders under `if __name__ == "__main__":`, or use workers=1.'
            )
        return RenderError(
            "A worker process died, perhaps for lack of memory. Use fewer workers or smaller tiles."
        )


@contextmanager
def shared_out(
    count: int | None, do: Callable[[Task], Result], start_after: float = 0.0
) -> Iterator[Each[Task, Result]]:
    """Run tasks in `count` worker processes, or in this process if `count` is 1.

    Workers start once this process has run tasks for `start_after` CPU seconds.
    """
    _end_if_imported()
    with ExitStack() as stack:
        crew: list[Workers[Task, Result]] = []
        spent = 0.0

        def each(tasks: Iterable[Task]) -> Iterator[tuple[Task, Result]]:
            nonlocal spent
            waiting = deque(tasks)
            while waiting and (not count or count == 1 or spent < start_after):
                task, begun = waiting.popleft(), time.process_time()
                result = do(task)
                spent += time.process_time() - begun
                yield task, result
            if waiting and count:
                if not crew:
                    crew.append(stack.enter_context(Workers(count, do)))
                yield from crew[0].each(waiting)

        yield each


def _end_if_imported() -> None:
    """End a worker that is still importing the user's script: rendering there would start workers again."""
    if getattr(multiprocessing.current_process(), "_inheriting", False):
        sys.exit(UNGUARDED_EXIT)


@contextmanager
def _unheard() -> Iterator[None]:
    """Keep Ctrl-C from the processes that are started meanwhile: a terminal sends it to all of them.

    This process hears it afterwards, and ends them.
    """
    # It is started with the first process, and lets the signals through again once it runs.
    resource_tracker.ensure_running()
    with _deferred():
        before = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT, signal.SIGTERM})
        try:
            yield
        finally:
            signal.pthread_sigmask(signal.SIG_SETMASK, before)


@contextmanager
def _deferred() -> Iterator[None]:
    """Handle signals afterwards: an interrupted start would leave a process waiting for its task.

    Blocking them does not do that. Another thread, such as one of NumPy's, takes them then, and Python still
    runs their handlers in the main thread.
    """
    heard: list[int] = []
    handlers = {number: signal.getsignal(number) for number in (signal.SIGINT, signal.SIGTERM, signal.SIGHUP)}
    if threading.current_thread() is not threading.main_thread():
        handlers.clear()
    replaced = {number: handler for number, handler in handlers.items() if callable(handler)}
    for number in replaced:
        signal.signal(number, lambda number, _: heard.append(number))
    try:
        yield
    finally:
        for number, handler in replaced.items():
            signal.signal(number, handler)
        for late in heard:
            signal.raise_signal(late)


def _work(connection: Connection, do: Callable[[Task], Result]) -> None:
    threading.Thread(target=_end_with_parent, daemon=True).start()
    with suppress(EOFError, BrokenPipeError):  # the parent has closed the pipe
        while True:
            connection.send(_answer(do, connection.recv()))


def _answer(do: Callable[[Task], Result], task: Task) -> tuple[bool, Result | Exception]:
    try:
        return True, do(task)
    except Exception as error:  # noqa: BLE001 - it is raised where the task came from
        error.add_note(traceback.format_exc())
        return False, error


def _end_with_parent() -> None:
    parent = multiprocessing.parent_process()
    assert parent is not None
    parent.join()
    os._exit(1)
