"""Request ids in answers and in the log."""

from __future__ import annotations

import json
import re
from collections.abc import Iterator
from pathlib import Path

import httpx2
import pytest

from service.server import running
from service.settings import Settings
from tests.service.support import TIMEOUT, scene, until
from tests.service.test_assets import put
from tests.service.test_meshes import FILES, with_mesh

Talk = tuple[httpx2.Client, Path]


@pytest.fixture(scope="module")
def talk(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Talk]:
    """A client of a service that logs everything, and its log."""
    folder: Path = tmp_path_factory.mktemp("logged")
    settings = Settings(data=folder / "data", port=0, workers=1, log_level="debug")
    with (
        (folder / "log").open("wb") as stderr,
        running(settings, stderr=stderr) as server,
        httpx2.Client(base_url=server.url, timeout=TIMEOUT) as client,
    ):
        yield client, folder / "log"


def logged(log: Path, **wanted: object) -> list[dict[str, object]]:
    lines = [json.loads(line) for line in log.read_text().splitlines()]
    return [line for line in lines if all(line.get(name) == value for name, value in wanted.items())]


@pytest.mark.parametrize("path", ["/livez", "/version", "/v1/jobs/none", "/nowhere"])
def test_the_name_that_is_given_comes_back(talk: Talk, path: str) -> None:
    answer = talk[0].get(path, headers={"X-Request-ID": "grade-17.b_c"})
    assert answer.headers["X-Request-ID"] == "grade-17.b_c"


@pytest.mark.parametrize("given", [None, "", "x" * 65, "two words", 'quote"', "grün".encode()])
def test_a_name_that_is_missing_or_odd_is_replaced(talk: Talk, given: str | bytes | None) -> None:
    headers = {} if given is None else {"X-Request-ID": given}
    names = [talk[0].get("/livez", headers=headers).headers["X-Request-ID"] for _ in range(2)]
    assert all(re.fullmatch(r"[0-9a-f]{16}", name) for name in names)
    assert names[0] != names[1]


def test_what_a_request_logs_has_its_name(talk: Talk) -> None:
    client, log = talk
    answer = client.post("/v1/jobs", json={"scene": scene()}, headers={"X-Request-ID": "mine"})
    (taken,) = logged(log, request="mine", event="job taken")
    assert taken["job"] == answer.json()["id"]
    # The answer is here before the service has logged that it is out.
    until(lambda: len(logged(log, request="mine", event="request")) == 1)
    (ended,) = logged(log, request="mine", event="request")
    assert (ended["method"], ended["path"], ended["status"]) == ("POST", "/v1/jobs", 202)
    # Tiles are logged under the job that the picture was made for, even if other users share it.
    client.post("/v1/jobs", json={"scene": scene()}, headers={"X-Request-ID": "again"})
    (again,) = logged(log, request="again", event="job taken")
    assert (again["job"] != taken["job"], again["render"]) == (True, taken["render"])
    assert taken["render"] == taken["job"]


def test_what_happens_to_a_tile_is_logged_with_job_and_tile(talk: Talk) -> None:
    client, log = talk
    job = client.post("/v1/jobs", json={"scene": scene(24, 24)}, headers={"Prefer": "wait=30"}).json()
    assert job["state"] == "succeeded"
    done = logged(log, job=job["id"], event="task done", outcome="TileDone")
    assert {(line["tile"], line["pass_index"], line["attempt"]) for line in done} == {
        (event["tile"], event["pass_index"], 1)
        for event in client.get(f"/v1/jobs/{job['id']}/tiles").json()["events"]
    }


def test_what_fails_in_a_worker_is_logged_without_what_was_in_it(talk: Talk) -> None:
    client, log = talk
    content = FILES["ply binary"]()[:2800]
    assert put(client, content).status_code == 200
    sent = {"scene": with_mesh(content), "labels": {"course": "not-for-logs"}}
    job = client.post("/v1/jobs", json=sent, headers={"Prefer": "wait=30"}).json()
    assert job["failure"]["code"] == "scene_not_usable"
    (failed,) = logged(log, event="task failed", job=job["id"], task="TileTask")
    assert "exception" in failed
    assert {"tile": 0, "pass_index": 0, "attempt": 1}.items() <= failed.items()
    assert "locals" not in json.dumps(failed["exception"])
    assert "not-for-logs" not in log.read_text()
