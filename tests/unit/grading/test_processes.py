"""Each errand has a process of its own: whatever happens to it, the others are done."""

from __future__ import annotations

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

PATIENCE = 120.0


def done(*errands: Errand, jobs: int = 2) -> dict[str, Finished]:
    return dict(run_all(errands, jobs))


def test_results_come_by_name_with_what_they_cost() -> None:
    found = done(*(Errand(str(number), partial(math.sqrt, number), PATIENCE) for number in (4, 9, 16)))
    assert {name: one.result for name, one in found.items()} == {"4": 2.0, "9": 3.0, "16": 4.0}
    assert all(one.seconds > 0 and one.error is None and one.trouble is None for one in found.values())


def test_a_late_errand_is_ended_and_costs_the_others_nothing() -> None:
    found = done(
        Errand("late", partial(time.sleep, 600), 0.5), Errand("good", partial(math.sqrt, 4), PATIENCE)
    )
    assert found["late"].trouble == "It timed out after 0.5 s."
    assert found["late"].result is None
    assert found["good"].result == 2.0


def test_a_process_that_dies_is_told_and_costs_the_others_nothing() -> None:
    found = done(
        Errand("left", partial(os._exit, 7), PATIENCE),
        Errand("killed", partial(signal.raise_signal, signal.SIGKILL), PATIENCE),
        Errand("good", partial(math.sqrt, 4), PATIENCE),
        jobs=1,
    )
    assert "exit code 7" in (found["left"].trouble or "")
    assert "exit code -9" in (found["killed"].trouble or "")
    assert found["good"].result == 2.0


@pytest.mark.parametrize(
    "after",
    ["__import__('time').sleep(600)", "__import__('os')._exit(7)", "1 / 0"],
    ids=["late", "died", "raised"],
)
def test_a_result_that_was_there_in_time_stays_whatever_comes_after(after: str) -> None:
    # Each result takes the place of the one before; what follows the last one takes nothing away.
    steps = partial(map, eval, ["1", "2", after])
    found = done(Errand("one", steps, 5.0))["one"]
    assert (found.result, found.error, found.trouble) == (2, None, None)


def test_what_is_raised_comes_back() -> None:
    error = done(Errand("wrong", partial(math.sqrt, -1), PATIENCE))["wrong"].error
    assert isinstance(error, ValueError)


def test_an_error_that_cannot_travel_is_told_in_words() -> None:
    raising = partial(exec, "class LocalError(Exception): pass\nraise LocalError('here')")
    assert str(done(Errand("wrong", raising, PATIENCE))["wrong"].error) == "LocalError: here"


def test_memory_beyond_what_is_given_is_refused_to_that_errand_alone() -> None:
    large = 1 << 33
    found = done(
        Errand("greedy", partial(bytearray, large), PATIENCE, memory=large // 2),
        Errand("good", partial(math.sqrt, 4), PATIENCE, memory=large // 2),
    )
    assert isinstance(found["greedy"].error, MemoryError)
    assert found["good"].result == 2.0


CHATTY = """
import os
from functools import partial
from service.grading.processes import Errand, run_all

if __name__ == "__main__":
    words = partial(print, "told", flush=True), partial(os.write, 1, b"written")
    found = dict(run_all([Errand(str(call), call, 60.0) for call in words], 1))
    print([one.error for one in found.values()])
"""


def test_words_of_an_errand_do_not_reach_stdout(tmp_path: Path) -> None:
    (tmp_path / "chatty.py").write_text(CHATTY)
    done = subprocess.run(
        [sys.executable, tmp_path / "chatty.py"],
        capture_output=True,
        text=True,
        timeout=PATIENCE,
        env=os.environ | {"PYTHONPATH": str(Path(__file__).parents[3])},
        check=True,
    )
    assert done.stdout == "[None, None]\n"
    assert "told" in done.stderr
    assert "written" in done.stderr


def test_who_stops_asking_leaves_no_process_behind() -> None:
    errands = [
        Errand("good", partial(math.sqrt, 4), PATIENCE),
        Errand("slow", partial(time.sleep, 600), PATIENCE),
    ]
    going = run_all(errands, 2)
    assert next(going)[0] == "good"
    going.close()
    assert not [child for child in multiprocessing.active_children() if child.is_alive()]
