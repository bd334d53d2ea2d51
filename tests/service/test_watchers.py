"""Many watchers of one job."""

from __future__ import annotations

from concurrent.futures import ThreadPoolExecutor
from typing import Any

import httpx2

from service.server import RunningServer
from tests.service.support import TIMEOUT, job_of, scene, submit

WATCHERS = 20


def watch(url: str, job: str) -> list[dict[str, Any]]:
    """Every event of a job, by long-polling from the first to the last."""
    events: list[dict[str, Any]] = []
    with httpx2.Client(base_url=url, timeout=TIMEOUT) as client:
        while True:
            news = client.get(f"/v1/jobs/{job}/tiles", params={"after": len(events), "wait": 5}).json()
            events += news["events"]
            if news["complete"]:
                return events


def test_twenty_watchers_get_the_same_events_in_the_same_order(
    server: RunningServer, client: httpx2.Client
) -> None:
    job = submit(client, scene(128, 96, samples=16, light_samples=16))
    with ThreadPoolExecutor(WATCHERS) as pool:
        reported = list(pool.map(lambda _: watch(server.url, job), range(WATCHERS)))
    # Tiles have sides of 32 pixels here: 4 x 3 of them in three passes, after the preview.
    assert [event["seq"] for event in reported[0]] == list(range(1, 3 * 12 + 2))
    assert job_of(client, job)["last_seq"] == len(reported[0])
    assert all(events == reported[0] for events in reported)
