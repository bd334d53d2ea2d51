"""Jobs that crash their workers, among others that do not; and a wall clock that changes while jobs run."""

from __future__ import annotations

import os
from pathlib import Path
from tempfile import TemporaryDirectory

import httpx2

from benchmarks.chaos import faulty
from benchmarks.chaos.ground import LONGEST, ended, picture, settings, submit
from benchmarks.load.promises import Promise
from service.server import running

REASONS = {"poison": "worker_died", "hungry": "out_of_memory", "endless": "took_too_long"}
HOUR = 3600.0


def ruinous(innocent: int) -> Promise:
    """Send a poisonous, an endless and a hungry job with innocent ones before and after them."""
    with TemporaryDirectory() as folder:
        # An innocent tile may wait behind one that kills its worker, but is not blamed for it.
        chosen = settings(Path(folder), max_task_seconds=5)
        with (
            running(chosen, module="benchmarks.chaos.faulty") as server,
            httpx2.Client(base_url=server.url, timeout=LONGEST) as client,
        ):
            others = [submit(client, picture(number)) for number in range(innocent // 2)]
            ruin = {name: submit(client, picture(0, name)) for name in REASONS}
            others += [submit(client, picture(number)) for number in range(innocent // 2, innocent)]
            failures = {name: ended(client, job).get("failure") or {} for name, job in ruin.items()}
            finished = sum(ended(client, job)["state"] == "succeeded" for job in others)
    codes = {name: failure.get("code") for name, failure in failures.items()}
    return Promise(
        promise="poison, endless and memory-hungry jobs fail alone, each with its reason",
        measured=f"{', '.join(map(str, codes.values()))}; {finished} of {innocent} others finished",
        held=codes == REASONS and finished == innocent,
        limit="the reason of each, all others finished",
        details={"failures": failures, "finished": finished},
    )


def clock_set(steps: tuple[float, ...] = (HOUR, -HOUR)) -> Promise:
    """Set the wall clock of the service while a job with a limit of time runs."""
    states = []
    for step in steps:
        with TemporaryDirectory() as folder:
            clock = Path(folder) / "step"
            clock.write_text("0")
            os.environ[faulty.STEP] = str(clock)
            chosen = settings(Path(folder) / "data")
            with (
                running(chosen, module="benchmarks.chaos.faulty") as server,
                httpx2.Client(base_url=server.url, timeout=LONGEST) as client,
            ):
                request = {"scene": picture(0, samples=100), "time_limit": HOUR / 2}
                job = str(client.post("/v1/jobs", json=request).json()["id"])
                client.get(f"/v1/jobs/{job}/tiles", params={"after": 0, "wait": 30})
                clock.write_text(str(step))
                states.append(ended(client, job)["state"])
                states.append(client.get(f"/v1/jobs/{job}/convergence").status_code)
            del os.environ[faulty.STEP]
    good = states == ["succeeded", 200] * len(steps)
    return Promise(
        promise="changing the wall clock ends no job, and no job has negative times",
        measured=", ".join(map(str, states)),
        held=good,
        limit="an hour forward and an hour back, limit of half an hour: all succeed",
        details={"steps": steps, "states": states},
    )
