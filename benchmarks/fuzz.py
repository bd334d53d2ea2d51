"""100,000 bodies that make no sense, sent to the real application: none is answered by an error of its own.

    python -m benchmarks.fuzz                     # 100,000 bodies, at most 5 minutes
    python -m benchmarks.fuzz --bodies 2000 --seed 7

Most are sent through the application as servers call it, in a process for each processor; every fiftieth over
a socket to a service of its own. All have a real database, real workers and real files. Prints a table, keeps
what was answered with 5xx in `out/fuzz/`, and writes `out/fuzz.json`.
"""

from __future__ import annotations

import argparse
import asyncio
import hashlib
import json
import multiprocessing
import os
import random
import sys
import tempfile
import time
from collections import Counter
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass, field
from datetime import UTC, datetime
from pathlib import Path
from typing import TYPE_CHECKING, Any

import httpx2

from accuracy.study.journal import describe
from benchmarks.fuzz_bodies import Bodies
from schemas.limits import Limits
from service import logs
from service.app import create_app
from service.server import running
from service.settings import Settings

if TYPE_CHECKING:
    from fastapi import FastAPI

OUT = Path("out/fuzz.json")
KEPT = Path("out/fuzz")
SHARE_BY_SOCKET = 50
AT_ONCE = 8
GROWTH_LIMIT_MIB = 150.0
"""What the process may grow after the first tenth: caches are full by then, and a leak does not stop."""
FIRST_SCENE = {
    "version": 1,
    "camera": {"position": [0, 0, 3], "look_at": [0, 0, 0], "vertical_fov": 40, "width": 4, "height": 4},
}

ROUTES = {"plans": 52, "jobs": 22, "assets": 12, "traces": 6, "comparisons": 3, "inspections": 2, "focus": 2}
"""How many of a hundred bodies go where. A quote takes a second: there is one among three hundred."""
QUOTES_OF = 300


@dataclass(frozen=True)
class Sent:
    """One request."""

    route: str
    method: str
    path: str
    body: bytes
    media_type: str = "application/json"


@dataclass
class Answers:
    """How requests were answered, by route and status, and those that broke something."""

    by_route: dict[str, Counter[int]] = field(default_factory=dict)
    broken: list[str] = field(default_factory=list)

    def count(self, sent: Sent, status: int) -> None:
        """Count one answer, and keep the request if the service is to blame."""
        self.by_route.setdefault(sent.route, Counter())[status] += 1
        if status >= 500:
            KEPT.mkdir(parents=True, exist_ok=True)
            name = f"{sent.route}-{status}-{hashlib.sha256(sent.body).hexdigest()[:12]}"
            (KEPT / name).write_bytes(sent.body)
            self.broken.append(name)

    def add(self, others: Answers) -> None:
        """Count what another process has counted."""
        for route, counts in others.by_route.items():
            self.by_route.setdefault(route, Counter()).update(counts)
        self.broken += others.broken

    @property
    def total(self) -> int:
        """All of them."""
        return sum(counts.total() for counts in self.by_route.values())


class Requests:
    """Makes requests; `job` is one that is there, so that what concerns a job gets beyond its name."""

    def __init__(self, source: random.Random, job: str) -> None:
        self.random, self._job = source, job
        self._bodies = Bodies(source)

    def make(self) -> Sent:
        """The next one."""
        if self.random.randrange(QUOTES_OF) == 0:
            return Sent("quotes", "POST", "/v1/quotes", self._bodies.quote())
        (route,) = self.random.choices(list(ROUTES), list(ROUTES.values()))
        if route == "assets":
            data = self._bodies.file()
            return Sent(route, "PUT", f"/v1/assets/{hashlib.sha256(data).hexdigest()}", data, "image/png")
        if route in {"inspections", "focus"}:
            return Sent(route, "POST", f"/v1/jobs/{self._job}/{route}", self._bodies.place())
        made = {"traces": self._bodies.trace, "comparisons": self._bodies.comparison}
        return Sent(route, "POST", f"/v1/{route}", made.get(route, self._bodies.job)())


async def call(app: FastAPI, sent: Sent) -> tuple[int, bytes]:
    """Send a request as a server does, and give status and body of the answer."""
    messages: list[dict[str, Any]] = []
    body = [{"type": "http.request", "body": sent.body, "more_body": False}]

    async def receive() -> dict[str, Any]:
        return body.pop() if body else {"type": "http.disconnect"}

    async def send(message: Any) -> None:
        messages.append(message)

    headers = [(b"host", b"127.0.0.1"), (b"content-type", sent.media_type.encode())]
    scope = {
        "type": "http", "asgi": {"version": "3.0"}, "http_version": "1.1", "method": sent.method,
        "headers": headers, "scheme": "http", "path": sent.path, "raw_path": sent.path.encode(),
        "query_string": b"", "server": ("127.0.0.1", 80), "client": ("127.0.0.1", 1), "root_path": "",
    }  # fmt: skip
    try:
        await app(scope, receive, send)
    except Exception:  # noqa: BLE001  (the framework answers 500, and raises again)
        return 500, b""
    status = next(one["status"] for one in messages if one["type"] == "http.response.start")
    return status, b"".join(one.get("body", b"") for one in messages)


def settings(folder: Path) -> Settings:
    """A service that refuses what takes long: the bodies are tried, not the workers."""
    return Settings(
        data=folder,
        port=0,
        workers=1,
        log_level="error",
        max_cpu_seconds=1.0,
        max_user_jobs=50,
        max_asset_bytes=100_000,
        max_trace_rays=100,
        limits=Limits(
            max_body_bytes=200_000,
            max_pixels=4096,
            max_samples=16,
            max_light_samples=16,
            max_shapes=500,
            max_image_pixels=1_000_000,
        ),
    )


@dataclass
class Outcome:
    """What a run has shown; memory in MiB."""

    answers: Answers
    by_socket: int
    seconds: float
    memory_at_first: float
    memory_at_last: float


def memory() -> float:
    """Resident memory of this process, MiB."""
    pages = int(Path("/proc/self/statm").read_text().split()[1])
    return pages * 4096 / 2**20


async def bulk(
    folder: Path, bodies: int, seed: int, deadline: float, answers: Answers
) -> tuple[float, float]:
    """Send requests in this process, a few at once; give its memory after a tenth, and at the end."""
    app = create_app(settings(folder))
    async with app.router.lifespan_context(app):
        first = Sent("first", "POST", "/v1/jobs", json.dumps({"scene": FIRST_SCENE}).encode())
        job = json.loads((await call(app, first))[1])["id"]
        made, noted = Requests(random.Random(seed), job), 0.0  # noqa: S311  (the same bodies each time)
        for number in range(0, bodies, AT_ONCE):
            batch = [made.make() for _ in range(min(AT_ONCE, bodies - number))]
            answered = await asyncio.gather(*(call(app, one) for one in batch))
            for sent, (status, _) in zip(batch, answered, strict=True):
                answers.count(sent, status)
            if number <= bodies // 10:
                noted = memory()
            if time.monotonic() > deadline:
                break
        return noted, memory()


def over_socket(folder: Path, bodies: int, seed: int, deadline: float, answers: Answers) -> int:
    """Send requests to a service in a process of its own; give how many."""
    count = 0
    with running(settings(folder)) as server, httpx2.Client(base_url=server.url, timeout=60) as client:
        job = client.post("/v1/jobs", json={"scene": FIRST_SCENE}).json()["id"]
        made = Requests(random.Random(seed + 1), job)  # noqa: S311  (the same bodies each time)
        while count < bodies and time.monotonic() < deadline:
            sent = made.make()
            headers = {"Content-Type": sent.media_type}
            answer = client.request(sent.method, sent.path, content=sent.body, headers=headers)
            answers.count(sent, answer.status_code)
            count += 1
    return count


def shard(folder: Path, bodies: int, seed: int, seconds: float) -> tuple[Answers, float, float]:
    """Send the share of one process."""
    logs.configure("critical")
    answers = Answers()
    deadline = time.monotonic() + seconds
    folder.mkdir()
    return answers, *asyncio.run(bulk(folder, bodies, seed, deadline, answers))


def run(bodies: int, seed: int, seconds: float, processes: int) -> Outcome:
    """Send all bodies, or as many as there is time for."""
    answers, begun = Answers(), time.monotonic()
    by_socket = bodies // SHARE_BY_SOCKET
    each = -(-(bodies - by_socket) // processes)
    with (
        tempfile.TemporaryDirectory(ignore_cleanup_errors=True) as name,
        ProcessPoolExecutor(processes, multiprocessing.get_context("spawn")) as pool,
    ):
        folder = Path(name)
        by_wire = over_socket(folder / "socket", by_socket, seed - 1, begun + seconds / 4, answers)
        left = begun + seconds - time.monotonic()
        shards = [
            pool.submit(shard, folder / str(number), each, seed + 1000 * number, left)
            for number in range(processes)
        ]
        done = [one.result() for one in shards]
    for part, _, _ in done:
        answers.add(part)
    _, first, last = max(done, key=lambda part: part[2] - part[1])
    return Outcome(answers, by_wire, time.monotonic() - begun, first, last)


def document(outcome: Outcome, asked: int, seed: int) -> dict[str, Any]:
    """The promises with their figures."""
    answers, growth = outcome.answers, outcome.memory_at_last - outcome.memory_at_first
    entries = [
        ("No body is answered by an error of the service (5xx)", len(answers.broken), 0),
        (
            "Memory does not grow with what is refused, MiB",
            round(growth, 1),
            GROWTH_LIMIT_MIB,
        ),
    ]
    promises: list[dict[str, Any]] = [
        {"promise": promise, "measured": measured, "held": measured <= limit, "limit": limit}
        for promise, measured, limit in entries
    ]
    promises[0]["details"] = {
        "bodies": answers.total,
        "asked": asked,
        "over_a_socket": outcome.by_socket,
        "seed": seed,
        "seconds": round(outcome.seconds, 1),
        "answers": {route: dict(sorted(counts.items())) for route, counts in answers.by_route.items()},
        "broken": answers.broken,
    }
    promises[1]["details"] = {
        "after_a_tenth": round(outcome.memory_at_first, 1),
        "at_the_end": round(outcome.memory_at_last, 1),
    }
    return {
        "machine": describe(),
        "date": datetime.now(UTC).isoformat(timespec="seconds"),
        "promises": promises,
    }


def table(outcome: Outcome) -> str:
    """How each route has answered."""
    lines = [f"{'route':<12} {'bodies':>7}  answers"]
    for route, counts in sorted(outcome.answers.by_route.items()):
        statuses = "  ".join(f"{status}: {count}" for status, count in sorted(counts.items()))
        lines.append(f"{route:<12} {counts.total():>7}  {statuses}")
    return "\n".join(lines)


def main() -> int:
    """Send, print and keep."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--bodies", type=int, default=100_000)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--seconds", type=float, default=300.0, help="when to stop at the latest")
    parser.add_argument("--processes", type=int, default=len(os.sched_getaffinity(0)))
    options = parser.parse_args()
    outcome = run(options.bodies, options.seed, options.seconds, options.processes)
    report = document(outcome, options.bodies, options.seed)
    OUT.parent.mkdir(exist_ok=True)
    OUT.write_text(json.dumps(report, indent=2) + "\n")
    sys.stdout.write(table(outcome) + "\n")
    for promise in report["promises"]:
        held = "held" if promise["held"] else "BROKEN"
        sys.stdout.write(f"{held}: {promise['promise']}: {promise['measured']}, at most {promise['limit']}\n")
    return 0 if all(promise["held"] for promise in report["promises"]) else 1


if __name__ == "__main__":
    sys.exit(main())
