"""Many users at once: what becomes of 300 small jobs that 30 users submit at the same time."""

from __future__ import annotations

import json
import statistics
import time
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from datetime import datetime
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import TYPE_CHECKING, Any, TypedDict

import httpx2

import scenes
from benchmarks.machine import Spread, describe, spread
from schemas.api.administration import Role
from service.access import keys
from service.server import running
from service.settings import Settings
from service.storage.database.connection import Database
from service.storage.database.migrations import upgrade

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

USERS = 30
JOBS_EACH = 10
SIDE = 64
LONGEST = 600.0
BASIC = Path(str(scenes.__file__)).parent / "gallery" / "basic.json"
# No client asks again sooner than this, seconds, whatever the service says.
PAUSE = 0.05


class Burst(TypedDict):
    """What became of a burst.

    `refusals` counts the answers 429, after which a job was sent again; `lost` the jobs that were
    accepted and did not succeed. `accepts_a_second` is over the time until the last job was accepted,
    `seconds` until the last one was finished. Waits are those of users, the mean over their jobs from being
    sent to being finished; `jain` is the fairness index of their speeds, 1 if all are the same. `first_tile`
    is from being sent to the first tile, of each job.
    """

    jobs: int
    users: int
    refusals: int
    lost: int
    accepts_a_second: float
    seconds: float
    waits: Spread
    jain: float
    first_tile: Spread


class Bursts(TypedDict):
    """The burst with as many scenes as jobs, and that with one scene for all."""

    workers: int
    different: Burst
    same: Burst


@dataclass(frozen=True)
class Sent:
    """A job that was accepted: whose it is, when it was sent first, and how often it was refused before."""

    user: str
    job: str
    sent: float
    accepted: float
    refusals: int


def measure(users: int = USERS, jobs_each: int = JOBS_EACH) -> Bursts:
    """Send both bursts to a service of their own."""
    workers = describe()["cores"]
    return Bursts(
        workers=workers,
        different=burst(users, jobs_each, scene, workers=workers),
        same=burst(users, jobs_each, lambda _: scene(0), workers=workers),
    )


def scene(number: int) -> dict[str, Any]:
    """Give a small picture of the basic scene, each number from a place of its own."""
    document: dict[str, Any] = json.loads(BASIC.read_text())
    camera = document["camera"]
    camera |= {"width": SIDE, "height": SIDE}
    camera["position"] = [camera["position"][0] + number / 1000, *camera["position"][1:]]
    return document


def burst(users: int, jobs_each: int, scene_of: Callable[[int], dict[str, Any]], **settings: Any) -> Burst:
    """Have every user send all jobs at once, and wait until they are finished."""
    with TemporaryDirectory() as folder:
        chosen = Settings(data=Path(folder), port=0, log_level="error", **settings)
        secrets = keys_for(chosen, users)
        with running(chosen) as server, ThreadPoolExecutor(users) as pool:
            begun = time.time()

            def all_of(place: int) -> list[tuple[Sent, dict[str, Any]]]:
                user, key = list(secrets.items())[place]
                asked = [scene_of(place * jobs_each + number) for number in range(jobs_each)]
                headers = {"Authorization": f"Bearer {key}"}
                with httpx2.Client(base_url=server.url, headers=headers, timeout=LONGEST) as client:
                    sent = [_submit(client, user, document) for document in asked]
                    return [(one, _followed(client, one.job)) for one in sent]

            found = [pair for pairs in pool.map(all_of, range(users)) for pair in pairs]
    return _summary(found, begun)


def keys_for(settings: Settings, users: int) -> dict[str, str]:
    """Make keys for so many users of a service that is to be started, by their names."""
    settings.data.mkdir(parents=True, exist_ok=True)
    database = Database(settings.database_url)
    upgrade(database)
    with database.writing() as session:
        names = [f"user {number}" for number in range(users)]
        secrets = {name: str(keys.add(session, name, Role.SUBMIT)) for name in names}
    database.close()
    return secrets


def _submit(client: httpx2.Client, user: str, document: dict[str, Any]) -> Sent:
    """Send a job until it is accepted; come back when the service says so."""
    sent, refusals = time.time(), 0
    while True:
        answer = client.post("/v1/jobs", json={"scene": document})
        if answer.status_code != httpx2.codes.TOO_MANY_REQUESTS:
            answer.raise_for_status()
            return Sent(user, answer.json()["id"], sent, time.time(), refusals)
        refusals += 1
        time.sleep(max(PAUSE, float(answer.headers["Retry-After"])))


def _followed(client: httpx2.Client, job: str) -> dict[str, Any]:
    """Wait for a job to end, and give it with the seconds after which it showed its first tile."""
    after: int = 0
    while True:
        batch = client.get(f"/v1/jobs/{job}/tiles", params={"after": after, "wait": 30}).json()
        after = batch["next"]
        if batch["complete"]:
            break
    passes = client.get(f"/v1/jobs/{job}/convergence").json()["passes"]
    found: dict[str, Any] = client.get(f"/v1/jobs/{job}").json()
    return found | {"first_tile": passes[0]["seconds"] if passes else 0.0}


def _summary(found: Sequence[tuple[Sent, dict[str, Any]]], begun: float) -> Burst:
    waits: dict[str, list[float]] = {}
    for sent, job in found:
        waits.setdefault(sent.user, []).append(_seconds_of(job["finished_at"]) - sent.sent)
    means = [statistics.mean(times) for times in waits.values()]
    first = [_first_tile(sent, job) for sent, job in found]
    accepted = max(sent.accepted for sent, _ in found) - begun
    return Burst(
        jobs=len(found),
        users=len(waits),
        refusals=sum(sent.refusals for sent, _ in found),
        lost=sum(job["state"] != "succeeded" for _, job in found),
        accepts_a_second=round(len(found) / accepted, 1),
        seconds=round(max(_seconds_of(job["finished_at"]) for _, job in found) - begun, 2),
        waits=spread(means),
        jain=round(jain([1.0 / mean for mean in means]), 4),
        first_tile=spread(first),
    )


def _first_tile(sent: Sent, job: dict[str, Any]) -> float:
    # A job that joins a render, or is answered from the store, shows what there is once it is accepted.
    shown: float = min(_seconds_of(job["started_at"]) + job["first_tile"], _seconds_of(job["finished_at"]))
    return max(shown, sent.accepted) - sent.sent


def _seconds_of(text: str) -> float:
    return datetime.fromisoformat(text).timestamp()


def jain(shares: Sequence[float]) -> float:
    """Fairness index of Jain, Chiu and Hawe: 1 if all have the same, 1 / n if one has everything.

    Examples
    --------
    >>> jain([2.0, 2.0]), jain([1.0, 0.0, 0.0, 0.0])
    (1.0, 0.25)
    """
    total: float = sum(shares)
    squares: float = sum(share * share for share in shares)
    return total * total / (len(shares) * squares)
