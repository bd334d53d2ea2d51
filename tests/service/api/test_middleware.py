"""Request ids in answers and in the log, and turns of clients."""

import asyncio
import json
import re
from collections import Counter
from collections.abc import Iterator
from pathlib import Path

import httpx2
import pytest
from starlette.types import Message, Receive, Scope, Send

from service.api.middleware import Turns, end_turn
from service.settings import Settings
from tests.service.forking import running
from tests.service.sending import DAMAGED, put, with_mesh
from tests.service.support import TIMEOUT, scene, until

Logged = tuple[httpx2.Client, Path]
WAIT = {"Prefer": "wait=30"}


@pytest.fixture(scope="module")
def logged(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Logged]:
    """A client of a server that logs everything, and its log."""
    folder: Path = tmp_path_factory.mktemp("logged")
    settings = Settings(data=folder / "data", port=0, workers=1, log_level="debug")
    with (
        (folder / "log").open("wb") as stderr,
        running(settings, stderr=stderr) as server,
        httpx2.Client(base_url=server.url, timeout=TIMEOUT) as client,
    ):
        yield client, folder / "log"


def lines(log: Path, **wanted: object) -> list[dict[str, object]]:
    found = [json.loads(line) for line in log.read_text().splitlines()]
    return [line for line in found if all(line.get(name) == value for name, value in wanted.items())]


@pytest.mark.parametrize("path", ["/livez", "/v1/jobs/none", "/nowhere"])
def test_request_id_comes_back(api: httpx2.Client, path: str) -> None:
    answer = api.get(path, headers={"X-Request-ID": "grade-17.b_c"})
    assert answer.headers["X-Request-ID"] == "grade-17.b_c"


@pytest.mark.parametrize("given", [None, "", "x" * 65, "two words", 'quote"', "grün".encode()])
def test_request_id_that_is_missing_or_odd_is_replaced(api: httpx2.Client, given: str | bytes | None) -> None:
    headers = {} if given is None else {"X-Request-ID": given}
    names = [api.get("/livez", headers=headers).headers["X-Request-ID"] for _ in range(2)]
    assert all(re.fullmatch(r"[0-9a-f]{16}", name) for name in names)
    assert names[0] != names[1]


def test_log_names_the_request_the_job_and_its_tiles(logged: Logged) -> None:
    client, log = logged
    sent = {"scene": scene(24, 24)}
    job = client.post("/v1/jobs", json=sent, headers=WAIT | {"X-Request-ID": "mine"}).json()
    (taken,) = lines(log, request="mine", event="job accepted")
    assert taken["job"] == taken["render"] == job["id"]
    # The answer is here before the service has logged that it is out.
    until(lambda: len(lines(log, request="mine", event="request")) == 1)
    (ended,) = lines(log, request="mine", event="request")
    assert (ended["method"], ended["path"], ended["status"]) == ("POST", "/v1/jobs", 202)
    done = lines(log, job=job["id"], event="task done", outcome="TileDone")
    assert {(line["tile"], line["pass_index"], line["attempt"]) for line in done} == {
        (event["tile"], event["pass_index"], 1)
        for event in client.get(f"/v1/jobs/{job['id']}/tiles").json()["events"]
    }
    # A job that shares a picture is logged with the job that it was made for.
    client.post("/v1/jobs", json=sent, headers={"X-Request-ID": "again"})
    (again,) = lines(log, request="again", event="job accepted")
    assert (again["job"] != job["id"], again["render"]) == (True, job["id"])


def test_log_of_a_failed_task_has_its_place_and_no_values(logged: Logged) -> None:
    client, log = logged
    assert put(client, DAMAGED).status_code == 200
    sent = {"scene": with_mesh(DAMAGED), "labels": {"course": "not-for-logs"}}
    job = client.post("/v1/jobs", json=sent, headers=WAIT).json()
    assert job["failure"]["code"] == "scene_not_usable"
    (failed,) = lines(log, event="task failed", job=job["id"], task="TileTask")
    assert {"tile": 0, "pass_index": 0, "attempt": 1}.items() <= failed.items()
    assert "locals" not in json.dumps(failed["exception"])
    assert "not-for-logs" not in log.read_text()


def test_requests_of_one_client_leave_threads_for_others() -> None:
    begun = Counter[tuple[str, str]]()

    async def app(scope: Scope, _receive: Receive, _send: Send) -> None:
        begun[dict(scope["headers"])[b"authorization"].decode(), scope["path"]] += 1
        if "poll" in scope["path"]:
            await end_turn(scope)
        await asyncio.Event().wait()

    async def asked(*requests: tuple[str, str]) -> None:
        turns = Turns(app)
        tasks = [
            asyncio.create_task(turns(scope_of(user, path), no_message, no_answer)) for user, path in requests
        ]
        # All go as far as they can.
        for _ in range(10):
            await asyncio.sleep(0)
        for task in tasks:
            task.cancel()
        await asyncio.gather(*tasks, return_exceptions=True)

    polls, lists = [("ann", "/v1/poll")] * 50, [("ann", "/v1/jobs")] * 50
    asyncio.run(asked(*polls, *lists, ("ann", "/livez"), ("bob", "/v1/jobs")))
    # What waits for news takes no thread.
    assert begun["ann", "/v1/poll"] == 50
    assert 1 <= begun["ann", "/v1/jobs"] <= 10
    assert begun["ann", "/livez"] == begun["bob", "/v1/jobs"] == 1


def scope_of(user: str, path: str) -> Scope:
    headers = [(b"authorization", user.encode())]
    return {"type": "http", "path": path, "headers": headers, "client": ("127.0.0.1", 1)}


async def no_message() -> Message:
    return {"type": "http.disconnect"}


async def no_answer(_message: Message) -> None:
    """Drop it."""
