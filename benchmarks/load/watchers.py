"""Many watchers of one job: by server-sent events, and by long polling."""

from __future__ import annotations

import asyncio
import json
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import TYPE_CHECKING, Any

import httpx2

from benchmarks.bursts import LONGEST, scene
from benchmarks.load.processes import cpu_seconds
from benchmarks.load.promises import Promise, promise
from service.server import running
from service.settings import Settings

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence

    from service.server import RunningServer

SIDE = 192
TILE = 32
MOST_MS = 1.0
"""CPU time of the service for one watcher and one event, milliseconds."""


def measure(crowds: Sequence[int] = (1, 20, 200)) -> Iterator[Promise]:
    """Have crowds of more and more watchers follow a job each, and count what that costs the service."""
    found = {}
    with TemporaryDirectory() as folder:
        settings = Settings(data=Path(folder), port=0, workers=1, tile_size=TILE, log_level="error")
        with running(settings) as server:
            for number, crowd in enumerate(crowds):
                found[crowd] = asyncio.run(_watched(server, crowd, number))
    least, most = min(crowds), max(crowds)
    whole = all(entry["complete"] for entry in found.values())
    extra = found[most]["cpu_seconds"] - found[least]["cpu_seconds"]
    each = 1000 * extra / ((most - least) * found[most]["events"])
    spent = ", ".join(f"{entry['cpu_seconds']:.2f} s with {crowd}" for crowd, entry in found.items())
    yield promise(
        f"{most} watchers of one job, half by server-sent events and half by long polling, get every "
        "event in its order.",
        f"{most if whole else 'not all'} of {most}, {found[most]['events']} events each",
        held=whole,
        limit="all",
    )
    yield promise(
        "A watcher costs the service little.",
        f"{each:.2f} ms CPU for each watcher and event ({spent})",
        held=each <= MOST_MS,
        limit=f"{MOST_MS:g} ms",
        crowds={str(crowd): entry for crowd, entry in found.items()},
    )


async def _watched(server: RunningServer, crowd: int, number: int) -> dict[str, Any]:
    """Follow a job to its end with so many watchers."""
    limits = httpx2.Limits(max_connections=None)
    async with httpx2.AsyncClient(base_url=server.url, timeout=LONGEST, limits=limits) as client:
        before = cpu_seconds(server.process.pid)
        job = (await client.post("/v1/jobs", json={"scene": _document(number)})).json()["id"]
        ways = [_stream if place % 2 else _poll for place in range(crowd)]
        seen = await asyncio.gather(*(way(client, job) for way in ways))
        spent = cpu_seconds(server.process.pid) - before
        last = (await client.get(f"/v1/jobs/{job}")).json()["last_seq"]
    complete = all(events == list(range(1, last + 1)) for events in seen)
    return {"cpu_seconds": round(spent, 3), "events": last, "complete": complete}


async def _stream(client: httpx2.AsyncClient, job: str) -> list[int]:
    async with client.stream("GET", f"/v1/jobs/{job}/events") as answer:
        lines = [line async for line in answer.aiter_lines() if line.startswith("id:")]
    return [int(line.removeprefix("id:")) for line in lines]


async def _poll(client: httpx2.AsyncClient, job: str) -> list[int]:
    events: list[int] = []
    while True:
        asked = {"after": len(events), "wait": 30}
        news = json.loads((await client.get(f"/v1/jobs/{job}/tiles", params=asked)).content)
        events += [event["seq"] for event in news["events"]]
        if news["complete"]:
            return events


def _document(number: int) -> dict[str, Any]:
    document = scene(number)
    document["camera"] |= {"width": SIDE, "height": SIDE}
    return document
