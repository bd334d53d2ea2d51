"""Three hundred jobs at once by thirty users, and a queue that is too short for them."""

from __future__ import annotations

from tempfile import TemporaryDirectory
from typing import TYPE_CHECKING

import httpx2

from benchmarks.bursts import LONGEST, burst, scene
from benchmarks.load.promises import Promise, promise
from benchmarks.machine import describe
from service.server import running
from service.settings import Settings

if TYPE_CHECKING:
    from collections.abc import Iterator

ROOM = 5


def measure(users: int = 30, jobs_each: int = 10) -> Iterator[Promise]:
    """Send a burst to a queue with room for two thirds of it, and ask one user's full queue how it is."""
    jobs = users * jobs_each
    found = burst(users, jobs_each, scene, workers=describe()["cores"], max_queued_jobs=2 * jobs // 3)
    yield promise(
        f"Of {jobs} jobs that {users} users send at once none is lost, refused ones included.",
        f"{found['jobs'] - found['lost']} of {jobs} rendered, {found['refusals']} refused and sent again",
        held=(found["jobs"], found["lost"]) == (jobs, 0),
        limit="0 lost",
        **found,
    )
    yield promise(
        "Users who send the same work at once wait as long as each other.",
        f"{found['jain']:.3f} (fairness index of Jain)",
        held=found["jain"] >= 0.9,
        limit="at least 0.9",
        waits=found["waits"],
    )
    yield from refusals()


def refusals() -> Iterator[Promise]:
    """Fill the queue of a user, and compare what the next submission is answered."""
    with (
        TemporaryDirectory() as folder,
        running(_settings(folder)) as server,
        httpx2.Client(base_url=server.url, timeout=LONGEST) as client,
    ):
        answers = [client.post("/v1/jobs", json={"scene": _slow(number)}) for number in range(ROOM + 1)]
        headers = {name: answers[-1].headers.get(name) for name in ("Retry-After", "RateLimit")}
        for answer in answers[:-1]:
            client.post(f"/v1/jobs/{answer.json()['id']}/cancel")
    statuses = [answer.status_code for answer in answers]
    yield promise(
        "A full queue answers 429, says when to return, and how much of the limit is left.",
        f"{statuses[-1]}, Retry-After {headers['Retry-After']}, RateLimit {headers['RateLimit']}",
        held=statuses == [202] * ROOM + [429] and None not in headers.values(),
        limit="429 with Retry-After and RateLimit",
        statuses=statuses,
    )


def _settings(folder: str) -> Settings:
    return Settings.model_validate(
        {"data": folder, "port": 0, "workers": 1, "log_level": "error", "max_user_jobs": ROOM}
    )


def _slow(number: int) -> dict[str, object]:
    """Give a picture that is not finished before the queue is full."""
    document = scene(number)
    document["camera"] |= {"width": 512, "height": 512}
    document["sampling"] = {"antialiasing": {"pattern": "uniform", "samples": 64}}
    return document
