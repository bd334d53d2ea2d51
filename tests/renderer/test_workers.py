"""Worker processes of a render: results, errors and deaths."""

import multiprocessing
import os
import signal
import subprocess
import sys
from functools import partial
from pathlib import Path

import numpy as np
import pytest

import renderer
from renderer.errors import RenderError
from renderer.processors import usable_processors
from renderer.workers import Workers
from tests.pictures import pictures

pytestmark = pytest.mark.slow  # each starts processes
LARGE = 1 << 23
"""Bytes: many times what a pipe takes at once, so that a worker is caught in the middle of an answer."""


def test_tasks_are_done_once_each() -> None:
    with Workers(3, _squared) as crew:
        assert sorted(crew.each(range(20))) == [(n, n * n) for n in range(20)]
        assert sorted(crew.each(range(5))) == [(n, n * n) for n in range(5)]
        assert list(crew.each([])) == []
    assert not multiprocessing.active_children()


def test_error_comes_back_with_its_place() -> None:
    with Workers(2, _reciprocal) as crew, pytest.raises(ZeroDivisionError) as raised:
        list(crew.each([1, 0, 2]))
    assert "in _reciprocal" in "".join(raised.value.__notes__)
    assert not multiprocessing.active_children()


@pytest.mark.parametrize("bytes_before", [0, 1, LARGE // 2])
def test_worker_that_dies_in_an_answer_is_reported(bytes_before: int) -> None:
    """Its answer is cut off after so many bytes, of which this process has read all it could."""
    with Workers(2, partial(_half_an_answer, bytes_before)) as crew, pytest.raises(RenderError, match="died"):
        list(crew.each([0, 1]))


def test_workers_killed_with_unread_answers_are_reported() -> None:
    with Workers(2, _zeros) as crew:
        answers = crew.each([LARGE] * 8)
        next(answers)
        for process in multiprocessing.active_children():
            assert process.pid is not None
            os.kill(process.pid, signal.SIGKILL)
            process.join()
        with pytest.raises(RenderError, match="worker process died"):
            list(answers)


def test_end_does_not_wait_for_unwanted_answers() -> None:
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


def test_workers_ignore_signals_of_the_terminal(tmp_path: Path) -> None:
    """In a process that has started none before: what is started beside the first lets signals through."""
    script = tmp_path / "heard.py"
    script.write_text(HEARD)
    environment = os.environ | {"PYTHONPATH": str(Path(__file__).parents[2])}
    heard = subprocess.check_output([sys.executable, script], env=environment, text=True)
    assert heard.strip() == str([[signal.SIGINT.value, signal.SIGTERM.value]] * 2)


UNGUARDED = """
import renderer

camera = {"position": [0, 0, 3], "look_at": [0, 0, 0]}
renderer.render(renderer.compile_scene({"version": 1, "camera": camera}), workers=2)
"""


def test_script_without_main_guard_is_told_once(tmp_path: Path) -> None:
    script = tmp_path / "unguarded.py"
    script.write_text(UNGUARDED)
    environment = os.environ | {"PYTHONPATH": str(Path(__file__).parents[2])}
    done = subprocess.run(
        [sys.executable, script], env=environment, text=True, capture_output=True, timeout=60, check=False
    )
    assert done.returncode == 1
    assert done.stderr.count('if __name__ == "__main__":') == 1
    assert done.stderr.count("Traceback") == 1


@pytest.mark.parametrize(("side", "started"), [(16, False), (512, True)])
def test_workers_start_only_where_they_pay(side: int, started: bool) -> None:
    room = pictures.of_room()
    plan = renderer.compile_scene({**room, "camera": {**room["camera"], "width": side, "height": side}})
    most = 0

    def count(event: renderer.TileEvent) -> None:
        nonlocal most
        most = max(most, len(multiprocessing.active_children()))

    image = renderer.render(plan, on_tile=count, workers="auto", tile_size=64).image
    assert (most > 0) == (started and usable_processors() > 1)
    assert image.tobytes() == renderer.render(plan).image.tobytes()


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
