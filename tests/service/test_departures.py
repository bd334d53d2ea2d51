"""Jobs that are deleted while others read or watch them, and clients that leave before their answer ends."""

import json
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from threading import Barrier

import httpx2
import pytest

from service.settings import Settings
from tests.service.conftest import Start
from tests.service.forking import running
from tests.service.sending import put
from tests.service.support import TIMEOUT, finish, long_scene, scene, submit, until, wait

pytestmark = pytest.mark.slow

BINARY = "application/octet-stream"
PARTS = [
    "image.npy",
    "image.png",
    "image.png?width=96",
    "image.exr",
    "layers/depth.npy",
    "tiles",
    "log",
    "request",
    "plan",
    "convergence",
]
ROUNDS = 12
WATCHERS = 6


def delete(client: httpx2.Client, job: str) -> None:
    assert client.delete(f"/v1/jobs/{job}").status_code == 204


def prune(client: httpx2.Client, job: str) -> None:
    pruned = client.post("/v1/prune", json={"max_stored_bytes": 0, "dry_run": False}).json()
    assert pruned["expired"] == [job]


@pytest.mark.parametrize("remove", [delete, prune])
def test_file_that_goes_away_is_whole_or_a_problem(
    start: Start, remove: Callable[[httpx2.Client, str], None]
) -> None:
    with httpx2.Client(base_url=start(workers=1).url, timeout=TIMEOUT) as client:
        answers: list[httpx2.Response] = []
        for _ in range(ROUNDS):
            job = finish(client, submit(client, scene(128, 96, samples=1), layers=["depth"]))["id"]
            begun = Barrier(len(PARTS) + 1)

            def read(part: str, path: str = f"/v1/jobs/{job}", begun: Barrier = begun) -> None:
                begun.wait(TIMEOUT)
                # A body that is shorter than its Content-Length is an error of the connection.
                answers.extend(client.get(f"{path}/{part}", headers={"Accept": BINARY}) for _ in range(4))

            with ThreadPoolExecutor(len(PARTS)) as pool:
                reading = [pool.submit(read, part) for part in PARTS]
                begun.wait(TIMEOUT)
                remove(client, job)
            for one in reading:
                one.result()
    # Those that came first have been answered 200, if there are some.
    assert {200} | {answer.status_code for answer in answers} == {200, 404 if remove is delete else 410}
    problems = [answer for answer in answers if answer.status_code != 200]
    assert {answer.headers["Content-Type"] for answer in problems} == {"application/problem+json"}


def test_asset_that_goes_away_is_whole_or_a_problem(start: Start) -> None:
    content = b"v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n" + b"# a comment\n" * 1000
    with httpx2.Client(base_url=start(workers=1).url, timeout=TIMEOUT) as client:
        statuses = set()
        for _ in range(ROUNDS):
            path = f"/v1/assets/{put(client, content).json()['name'].removeprefix('sha256:')}"
            with ThreadPoolExecutor(1) as pool:
                rules = {"keep_asset_seconds": 0, "dry_run": False}
                pruned = pool.submit(client.post, "/v1/prune", json=rules)
                statuses |= {client.get(path).status_code for _ in range(8)}
            assert pruned.result().status_code == 200
    assert {200} | statuses == {200, 404}


def events(client: httpx2.Client, job: str, begun: Barrier) -> list[tuple[str, str]]:
    """The kinds of the events of a stream and their data; the barrier opens at the first."""
    found = []
    with client.stream("GET", f"/v1/jobs/{job}/events") as answer:
        lines = answer.iter_lines()
        for line in lines:
            if line.startswith("event: "):
                found.append((line.removeprefix("event: "), next(lines).removeprefix("data: ")))
                if len(found) == 1:
                    begun.wait(TIMEOUT)
    return found


def test_stream_of_a_deleted_job_ends_with_its_end(start: Start) -> None:
    with httpx2.Client(base_url=start(workers=2, tile_size=32).url, timeout=TIMEOUT) as client:
        for _ in range(ROUNDS):
            job = submit(client, long_scene())
            wait(client, job, lambda found: found["last_seq"] > 0)
            begun = Barrier(WATCHERS + 1)
            with ThreadPoolExecutor(WATCHERS) as pool:
                watching = [pool.submit(events, client, job, begun) for _ in range(WATCHERS)]
                begun.wait(TIMEOUT)
                delete(client, job)
            for watched in watching:
                kind, data = watched.result()[-1]
                assert (kind, json.loads(data)["state"]) == ("end", "cancelled")


def test_clients_that_leave_are_no_failures(tmp_path: Path) -> None:
    settings = Settings(data=tmp_path / "data", port=0, workers=2, tile_size=16, log_level="warning")
    log = tmp_path / "log"
    with (
        log.open("wb") as stderr,
        running(settings, stderr=stderr) as server,
        httpx2.Client(base_url=server.url, timeout=TIMEOUT) as client,
    ):
        many = finish(client, submit(client, scene(384, 384, samples=1, light_samples=1)))["id"]
        paused = submit(client, long_scene())
        wait(client, paused, lambda found: found["last_seq"] > 0)
        client.post(f"/v1/jobs/{paused}/pause").raise_for_status()
        for _ in range(3 * WATCHERS):
            for path in (f"{many}/events", f"{paused}/events", f"{many}/image.npy"):
                with client.stream("GET", f"/v1/jobs/{path}") as answer:
                    next(answer.iter_raw())
        for path in (f"{paused}/events", f"{paused}/tiles?after=1000&wait=5"):
            with pytest.raises(httpx2.ReadTimeout):
                client.get(f"/v1/jobs/{path}", timeout=0.2)
        until(lambda: client.get("/readyz").status_code == 200)
    # Requests made before the service was ready are reported.
    assert [line for line in log.read_text().splitlines() if "/readyz" not in line] == []
