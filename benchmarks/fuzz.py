"""100,000 malformed bodies, sent through the real application: no 5xx, and memory stays flat.

`python -m benchmarks.fuzz --bodies 2000 --seed 7` sends fewer, and others. The application has a real
database, real workers and real files; there is one for each processor. A body that is answered with 5xx is
kept in out/fuzz.
"""

from __future__ import annotations

import argparse
import asyncio
import hashlib
import multiprocessing
import os
import random
import tempfile
import time
from collections import Counter, defaultdict
from concurrent.futures import ProcessPoolExecutor
from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple

import httpx2

from benchmarks.fuzz_bodies import Bodies
from benchmarks.jobs import resident_mib, settings
from benchmarks.report import OUT, conclude, promise, show
from schemas.limits import Limits
from service import logs
from service.app import create_app

if TYPE_CHECKING:
    from service.settings import Settings

AT_ONCE = 8
GROWTH_LIMIT_MIB = 150.0
"""Memory growth allowed after the first tenth: caches are full by then, and a leak does not stop."""
FIRST_SCENE = {
    "version": 1,
    "camera": {"position": [0, 0, 3], "look_at": [0, 0, 0], "vertical_fov": 40, "width": 4, "height": 4},
}
ROUTES = {"plans": 52, "jobs": 22, "assets": 12, "traces": 6, "comparisons": 3, "inspections": 2, "focus": 2}
"""How many of a hundred bodies go where. A quote takes a second: there is one among three hundred."""
QUOTES_OF = 300


class Sent(NamedTuple):
    """One request."""

    route: str
    method: str
    path: str
    body: bytes
    media_type: str = "application/json"


def made(bodies: Bodies, job: str) -> Sent:
    """The next request; what concerns a job gets one that is there."""
    if bodies.random.randrange(QUOTES_OF) == 0:
        return Sent("quotes", "POST", "/v1/quotes", bodies.quote())
    (route,) = bodies.random.choices(list(ROUTES), list(ROUTES.values()))
    match route:
        case "assets":
            data = bodies.file()
            return Sent(route, "PUT", f"/v1/assets/{hashlib.sha256(data).hexdigest()}", data, "image/png")
        case "inspections" | "focus":
            return Sent(route, "POST", f"/v1/jobs/{job}/{route}", bodies.place())
        case "traces":
            return Sent(route, "POST", "/v1/traces", bodies.trace())
        case "comparisons":
            return Sent(route, "POST", "/v1/comparisons", bodies.comparison())
    return Sent(route, "POST", f"/v1/{route}", bodies.job())


def strict(folder: Path) -> Settings:
    """A service that refuses what takes long: the bodies are tried, not the workers."""
    limits = Limits(
        max_body_bytes=200_000,
        max_pixels=4096,
        max_samples=16,
        max_light_samples=16,
        max_shapes=500,
        max_image_pixels=1_000_000,
    )
    return settings(
        folder,
        max_cpu_seconds=1.0,
        max_user_jobs=50,
        max_asset_bytes=100_000,
        max_trace_rays=100,
        limits=limits,
    )


class Answers(NamedTuple):
    """Statuses by route, bodies that were answered with 5xx, and memory after a tenth and at the end, MiB."""

    statuses: dict[str, Counter[int]]
    broken: list[str]
    memory: tuple[float, float]


async def send_all(folder: Path, count: int, seed: int, seconds: float) -> Answers:
    """Send bodies in this process, a few at once."""
    app = create_app(strict(folder))
    bodies = Bodies(random.Random(seed))  # noqa: S311  (the same bodies each time)
    statuses: defaultdict[str, Counter[int]] = defaultdict(Counter)
    broken: list[str] = []
    noted, deadline = 0.0, time.monotonic() + seconds
    transport = httpx2.ASGITransport(app=app, raise_app_exceptions=False)
    async with (
        app.router.lifespan_context(app),
        httpx2.AsyncClient(transport=transport, base_url="http://127.0.0.1") as client,
    ):
        job = (await client.post("/v1/jobs", json={"scene": FIRST_SCENE})).json()["id"]

        async def send(sent: Sent) -> None:
            headers = {"Content-Type": sent.media_type}
            answer = await client.request(sent.method, sent.path, content=sent.body, headers=headers)
            statuses[sent.route][answer.status_code] += 1
            if answer.status_code >= 500:
                name = f"{sent.route}-{answer.status_code}-{hashlib.sha256(sent.body).hexdigest()[:12]}"
                (OUT / "fuzz").mkdir(parents=True, exist_ok=True)
                (OUT / "fuzz" / name).write_bytes(sent.body)
                broken.append(name)

        for number in range(0, count, AT_ONCE):
            await asyncio.gather(*(send(made(bodies, job)) for _ in range(AT_ONCE)))
            if number <= count // 10:
                noted = resident_mib(os.getpid())
            if time.monotonic() > deadline:
                break
    return Answers(dict(statuses), broken, (noted, resident_mib(os.getpid())))


def shard(folder: Path, count: int, seed: int, seconds: float) -> Answers:
    """Send the share of one process."""
    logs.configure("critical")
    folder.mkdir()
    return asyncio.run(send_all(folder, count, seed, seconds))


def main() -> None:
    """Send all bodies, or as many as there is time for; 1 if the service broke or grew."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks.fuzz", description=__doc__)
    parser.add_argument("--bodies", type=int, default=100_000)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--seconds", type=float, default=300.0, help="when to stop at the latest")
    options = parser.parse_args()
    processes = len(os.sched_getaffinity(0))
    context = multiprocessing.get_context("spawn")
    with (
        tempfile.TemporaryDirectory(ignore_cleanup_errors=True) as name,
        ProcessPoolExecutor(processes, context) as pool,
    ):
        share = -(-options.bodies // processes)
        shards = [
            pool.submit(shard, Path(name) / str(number), share, options.seed + 1000 * number, options.seconds)
            for number in range(processes)
        ]
        found = [one.result() for one in shards]
    totals: defaultdict[str, Counter[int]] = defaultdict(Counter)
    for part in found:
        for route, counts in part.statuses.items():
            totals[route] += counts
    rows = [(route, counts.total(), dict(sorted(counts.items()))) for route, counts in sorted(totals.items())]
    show("Answers", ("route", "bodies", "by status"), rows)
    broken = [name for part in found for name in part.broken]
    growth = max(last - first for _, _, (first, last) in found)
    sent = sum(counts.total() for counts in totals.values())
    conclude(
        "fuzz",
        [
            promise(
                f"None of {sent:,} bodies is answered with 5xx.",
                f"{len(broken)}",
                held=not broken,
                limit="0",
                broken=broken,
                seed=options.seed,
                answers={route: dict(counts) for route, counts in totals.items()},
            ),
            promise(
                "Memory does not grow with what is refused.",
                f"{growth:.1f} MiB after the first tenth",
                held=growth <= GROWTH_LIMIT_MIB,
                limit=f"{GROWTH_LIMIT_MIB:g} MiB",
            ),
        ],
    )


if __name__ == "__main__":
    main()
