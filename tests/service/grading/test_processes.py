"""Each errand has its own process: whatever happens to it, the others finish."""

import math
import multiprocessing
import os
import signal
import subprocess
import sys
import time
from functools import partial
from pathlib import Path

import pytest

from service.grading.processes import Errand, Finished, run_all

TIMEOUT = 120.0


def done(*errands: Errand, jobs: int = 2) -> dict[str, Finished]:
    return dict(run_all(errands, jobs))


def test_results_come_by_name_with_what_they_cost() -> None:
    found = done(*(Errand(str(number), partial(math.sqrt, number), TIMEOUT) for number in (4, 9, 16)))
    assert {name: one.result for name, one in found.items()} == {"4": 2.0, "9": 3.0, "16": 4.0}
    assert all(one.seconds > 0 and one.error is None for one in found.values())


def test_late_errand_is_killed_and_the_others_finish() -> None:
    found = done(
        Errand("late", partial(time.sleep, 600), 0.5), Errand("good", partial(math.sqrt, 4), TIMEOUT)
    )
    assert str(found["late"].error) == "It timed out after 0.5 s."
    assert found["late"].result is None
    assert found["good"].result == 2.0


def test_dead_process_is_reported_and_the_others_finish() -> None:
    found = done(
        Errand("left", partial(os._exit, 7), TIMEOUT),
        Errand("killed", partial(signal.raise_signal, signal.SIGKILL), TIMEOUT),
        Errand("good", partial(math.sqrt, 4), TIMEOUT),
        jobs=1,
    )
    assert "exit code 7" in str(found["left"].error)
    assert "exit code -9" in str(found["killed"].error)
    assert found["good"].result == 2.0


@pytest.mark.parametrize(
    "after",
    [
        pytest.param("__import__('time').sleep(600)", marks=pytest.mark.slow, id="late"),
        pytest.param("__import__('os')._exit(7)", id="died"),
        pytest.param("1 / 0", id="raised"),
    ],
)
def test_result_that_arrived_in_time_is_kept(after: str) -> None:
    # Each result replaces the previous one; an error after the last result is ignored.
    steps = partial(map, eval, ["1", "2", after])
    found = done(Errand("one", steps, 5.0))["one"]
    assert (found.result, found.error) == (2, None)


def test_memory_limit_affects_only_its_errand() -> None:
    large = 1 << 33
    found = done(
        Errand("greedy", partial(bytearray, large), TIMEOUT, memory=large // 2),
        Errand("good", partial(math.sqrt, 4), TIMEOUT, memory=large // 2),
    )
    assert isinstance(found["greedy"].error, MemoryError)
    assert found["good"].result == 2.0


CHATTY = """
import os
from functools import partial
from service.grading.processes import Errand, run_all

if __name__ == "__main__":
    words = partial(print, "printed", flush=True), partial(os.write, 1, b"written")
    found = dict(run_all([Errand(str(call), call, 60.0) for call in words], 1))
    print([one.error for one in found.values()])
"""


@pytest.mark.slow
def test_output_of_an_errand_does_not_reach_stdout(tmp_path: Path) -> None:
    (tmp_path / "chatty.py").write_text(CHATTY)
    done = subprocess.run(
        [sys.executable, tmp_path / "chatty.py"],
        capture_output=True,
        text=True,
        timeout=TIMEOUT,
        env=os.environ | {"PYTHONPATH": str(Path(__file__).parents[3])},
        check=True,
    )
    assert done.stdout == "[None, None]\n"
    assert "printed" in done.stderr
    assert "written" in done.stderr


def test_closed_generator_leaves_no_process_behind() -> None:
    errands = [
        Errand("good", partial(math.sqrt, 4), TIMEOUT),
        Errand("slow", partial(time.sleep, 600), TIMEOUT),
    ]
    before = set(multiprocessing.active_children())
    going = run_all(errands, 2)
    assert next(going)[0] == "good"
    going.close()
    assert not [child for child in set(multiprocessing.active_children()) - before if child.is_alive()]
