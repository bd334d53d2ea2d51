"""Worker processes: every task is done once, and no death or error of one makes the others wait."""

import multiprocessing
import os
import signal
import subprocess
import sys
from functools import partial
from pathlib import Path

import numpy as np
import pytest

from renderer.errors import RenderError
from renderer.workers import Workers

pytestmark = pytest.mark.slow  # each starts processes

LARGE = 1 << 23
"""Bytes: many times what a pipe takes at once, so that a worker is caught in the middle of an answer."""


def test_every_task_is_done_once_and_comes_back_with_its_result() -> None:
    with Workers(3, _squared) as crew:
        assert sorted(crew.each(range(20))) == [(n, n * n) for n in range(20)]
        assert sorted(crew.each(range(5))) == [(n, n * n) for n in range(5)]
        assert list(crew.each([])) == []
    assert not multiprocessing.active_children()


def test_an_error_comes_back_as_it_was_raised_with_its_place() -> None:
    with Workers(2, _reciprocal) as crew, pytest.raises(ZeroDivisionError) as raised:
        list(crew.each([1, 0, 2]))
    assert "in _reciprocal" in "".join(raised.value.__notes__)
    assert not multiprocessing.active_children()


@pytest.mark.parametrize("bytes_before", [0, 1, LARGE // 2])
def test_a_worker_that_dies_in_the_middle_of_an_answer_is_reported(bytes_before: int) -> None:
    """Its answer is cut off after so many bytes, of which this process has read all it could."""
    with Workers(2, partial(_half_an_answer, bytes_before)) as crew, pytest.raises(RenderError, match="died"):
        list(crew.each([0, 1]))


def test_workers_that_are_killed_while_their_answers_are_unread_are_reported() -> None:
    with Workers(2, _zeros) as crew:
        answers = crew.each([LARGE] * 8)
        next(answers)
        for process in multiprocessing.active_children():
            assert process.pid is not None
            os.kill(process.pid, signal.SIGKILL)
            process.join()
        with pytest.raises(RenderError, match="worker process died"):
            list(answers)


def test_the_end_does_not_wait_for_unwanted_answers() -> None:
    with Workers(2, _zeros) as crew:
        next(crew.each([LARGE] * 100))
    assert not multiprocessing.active_children()


HEARD = """
import signal
from renderer.workers import Workers

def blocked(_):
    return sorted(map(int, signal.pthread_sigmask(signal.SIG_BLOCK, [])))

if __name__ == "__main__":
    with Workers(2, blocked) as crew:
        print([heard for _, heard in crew.each([0, 1])])
"""


def test_workers_do_not_hear_what_a_terminal_sends_to_all(tmp_path: Path) -> None:
    """In a process that has started none before: what is started beside the first lets signals through."""
    script = tmp_path / "heard.py"
    script.write_text(HEARD)
    environment = os.environ | {"PYTHONPATH": str(Path(__file__).parents[3])}
    heard = subprocess.check_output([sys.executable, script], env=environment, text=True)
    assert heard.strip() == str([[signal.SIGINT.value, signal.SIGTERM.value]] * 2)


def _squared(number: int) -> int:
    return number * number


def _reciprocal(number: int) -> float:
    return 1 / number


def _zeros(size: int) -> np.ndarray:
    return np.zeros(size, dtype=np.uint8)


def _half_an_answer(before: int, task: int) -> None:
    """Write the head of a long message and some of it into the pipe to the parent, then die."""
    import gc
    import struct
    from multiprocessing.connection import Connection

    (pipe,) = [item for item in gc.get_objects() if isinstance(item, Connection)]
    os.write(pipe.fileno(), struct.pack("!i", LARGE))
    written = 0
    while written < before:
        written += os.write(pipe.fileno(), bytes(min(65536, before - written)))
    os._exit(1)
