"""100,000 malformed bodies, sent through the real application: no 5xx, and memory stays flat.

There is an application for each processor, with a real database, real workers and real files. A body that is
answered with 5xx is kept in out/fuzz.
"""

from __future__ import annotations

import asyncio
import hashlib
import multiprocessing
import os
import random
import tempfile
import time
from collections import Counter
from concurrent.futures import ProcessPoolExecutor
from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple

import httpx2

from benchmarks.fuzz_bodies import Bodies
from benchmarks.jobs import CORES, resident_mib, settings
from benchmarks.report import OUT, Promise, conclude, parser, show
from schemas.limits import Limits
from service import logs
from service.app import create_app

if TYPE_CHECKING:
    from service.settings import Settings

AT_ONCE = 8
GROWTH_LIMIT_MIB = 150.0
"""Memory growth allowed after the first tenth: caches are full by then, and a leak does not stop."""
CAMERA = {"position": [0, 0, 3], "look_at": [0, 0, 0], "vertical_fov": 40, "width": 4, "height": 4}
ROUTES = {
    "plans": 5200, "jobs": 2200, "assets": 1200, "traces": 600, "comparisons": 300,
    "jobs/{}/inspections": 200, "jobs/{}/focus": 200, "quotes": 33,
}  # fmt: skip
"""Shares of the bodies by address; a quote takes a second."""


def strict(folder: Path) -> Settings:
    """A service that refuses what takes long: the bodies are tried, not the workers."""
    sizes = {"max_body_bytes": 200_000, "max_pixels": 4096, "max_shapes": 500, "max_image_pixels": 1_000_000}
    limits = Limits(**sizes, max_samples=16, max_light_samples=16)
    most = {"max_cpu_seconds": 1.0, "max_user_jobs": 50, "max_asset_bytes": 100_000, "max_trace_rays": 100}
    return settings(folder, **most, limits=limits)


class Answers(NamedTuple):
    """Answers by route and status, bodies answered with 5xx, and MiB of growth after the first tenth."""

    statuses: Counter[tuple[str, int]]
    broken: list[str]
    growth: float


async def send_all(folder: Path, count: int, seed: int, seconds: float) -> Answers:
    """Send bodies in this process, a few at once."""
    app = create_app(strict(folder))
    bodies = Bodies(random.Random(seed))  # noqa: S311  (the same bodies each time)
    statuses: Counter[tuple[str, int]] = Counter()
    broken: list[str] = []
    noted, deadline = 0.0, time.monotonic() + seconds
    transport = httpx2.ASGITransport(app=app, raise_app_exceptions=False)
    async with (
        app.router.lifespan_context(app),
        httpx2.AsyncClient(transport=transport, base_url="http://127.0.0.1") as client,
    ):
        job = (await client.post("/v1/jobs", json={"scene": {"version": 1, "camera": CAMERA}})).json()["id"]

        async def send(route: str, body: bytes) -> None:
            if route == "assets":
                path = f"/v1/assets/{hashlib.sha256(body).hexdigest()}"
                answer = await client.put(path, content=body, headers={"Content-Type": "image/png"})
            else:
                headers = {"Content-Type": "application/json"}
                answer = await client.post(f"/v1/{route.format(job)}", content=body, headers=headers)
            statuses[route, answer.status_code] += 1
            if answer.status_code >= 500:
                kind = route.rpartition("/")[2]
                name = f"{kind}-{answer.status_code}-{hashlib.sha256(body).hexdigest()[:12]}"
                (OUT / "fuzz").mkdir(parents=True, exist_ok=True)
                (OUT / "fuzz" / name).write_bytes(body)
                broken.append(name)

        for number in range(0, count, AT_ONCE):
            routes = bodies.random.choices(list(ROUTES), list(ROUTES.values()), k=AT_ONCE)
            await asyncio.gather(*(send(route, bodies.body(route)) for route in routes))
            if number <= count // 10:
                noted = resident_mib(os.getpid())
            if time.monotonic() > deadline:
                break
    return Answers(statuses, broken, resident_mib(os.getpid()) - noted)


def shard(folder: Path, count: int, seed: int, seconds: float) -> Answers:
    """Send the share of one process."""
    logs.configure("critical")
    folder.mkdir()
    return asyncio.run(send_all(folder, count, seed, seconds))


def main() -> None:
    """Send all bodies, or as many as there is time for; 1 if the service broke or grew."""
    options = parser("fuzz", __doc__)
    options.add_argument("--bodies", type=int, default=100_000)
    options.add_argument("--seed", type=int, default=1)
    options.add_argument("--seconds", type=float, default=300.0, help="when to stop at the latest")
    chosen = options.parse_args()
    with (
        tempfile.TemporaryDirectory(ignore_cleanup_errors=True) as name,
        ProcessPoolExecutor(CORES, multiprocessing.get_context("spawn")) as pool,
    ):
        share = -(-chosen.bodies // CORES)
        shards = [
            pool.submit(shard, Path(name) / str(number), share, chosen.seed + 1000 * number, chosen.seconds)
            for number in range(CORES)
        ]
        found = [one.result() for one in shards]
    totals = sum((part.statuses for part in found), Counter[tuple[str, int]]())
    show("Answers", ("route", "status", "bodies"), [(*key, count) for key, count in sorted(totals.items())])
    broken = sum(len(part.broken) for part in found)
    growth = max(part.growth for part in found)
    conclude(
        "fuzz",
        [
            Promise(f"None of {totals.total():,} bodies is answered with 5xx.", f"{broken}", "0", not broken),
            Promise(
                "Memory does not grow with what is refused.",
                f"{growth:.1f} MiB after the first tenth",
                f"{GROWTH_LIMIT_MIB:g} MiB",
                growth <= GROWTH_LIMIT_MIB,
            ),
        ],
    )


if __name__ == "__main__":
    main()
