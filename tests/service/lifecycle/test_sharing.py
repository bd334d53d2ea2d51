"""A picture is rendered once for all users, without revealing them to each other."""

import hashlib
import json
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import httpx2
import numpy as np
import pytest
from sqlalchemy import func, select

from schemas.api.administration import Role
from service.server import RunningServer
from service.settings import Settings
from service.storage.database.connection import Database
from service.storage.database.models import RenderRow
from tests.service.forking import running
from tests.service.sending import client_of, make_keys
from tests.service.support import SERVED, ended, image, job_of, long_scene, scene, until, wait

Users = dict[str, httpx2.Client]


@dataclass(frozen=True)
class Shared:
    """A server with the keys of its users, and the address of its database."""

    server: RunningServer
    keys: dict[str, str]
    url: str


@pytest.fixture(scope="module", params=SERVED)
def shared(request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory) -> Iterator[Shared]:
    url = request.getfixturevalue("postgres").database() if request.param == "postgresql" else None
    data = tmp_path_factory.mktemp("shared")
    settings = Settings(data=data, database=url, port=0, workers=1, tile_size=32, log_level="error")
    made = make_keys(data, url, ann=Role.SUBMIT, bob=Role.SUBMIT, eve=Role.SUBMIT)
    with running(settings) as server:
        yield Shared(server, made, settings.database_url)


@pytest.fixture(scope="module")
def users(shared: Shared) -> Iterator[Users]:
    clients = {user: client_of(shared.server, key) for user, key in shared.keys.items()}
    yield clients
    for client in clients.values():
        client.close()


@pytest.fixture
def folder(shared: Shared) -> Path:
    return shared.server.data / "jobs"


def ask(client: httpx2.Client, document: dict[str, Any], wait: int = 0, **request: Any) -> dict[str, Any]:
    answer = client.post(
        "/v1/jobs", json={"scene": document, **request}, headers={"Prefer": f"wait={wait}"} if wait else {}
    )
    assert answer.status_code == 202, answer.text
    return answer.json()


def small(number: int) -> dict[str, Any]:
    """A scene that no other test renders."""
    document = scene(32, 32, samples=1, light_samples=1)
    document["camera"]["position"][0] = number / 8
    return document


def slow(number: int) -> dict[str, Any]:
    """Seconds of work that no other test renders."""
    document = long_scene()
    document["camera"]["position"][0] = number / 8
    return document


def test_stored_picture_is_answered_at_once(users: Users, folder: Path) -> None:
    first = ask(users["ann"], small(1) | {"name": "secret"}, wait=30)
    second = ask(users["bob"], small(1), labels={"own": "yes"})
    assert (first["state"], second["state"]) == ("succeeded", "succeeded")
    assert (second["labels"], first["labels"]) == ({"own": "yes"}, {})
    assert np.array_equal(image(users["bob"], second["id"]), image(users["ann"], first["id"]))
    assert not (folder / second["id"]).exists()
    batch = users["bob"].get(f"/v1/jobs/{second['id']}/tiles").json()
    assert [event["seq"] for event in batch["events"]] == list(range(1, second["last_seq"] + 1))
    assert batch["complete"]
    # Nothing reveals the earlier user.
    assert second["started_at"] == second["finished_at"] == second["created_at"]
    reported = users["bob"].get(f"/v1/jobs/{second['id']}").text
    assert "secret" not in reported
    assert "ann" not in reported
    for path in ("", "/tiles", "/plan", "/convergence", "/request", "/image.png"):
        answer = users["bob"].get(f"/v1/jobs/{second['id']}{path}")
        assert answer.status_code == 200, path
        assert first["id"].encode() not in answer.content, path
        assert first["id"] not in str(answer.headers), path
    both = {"image": {"job": second["id"]}, "reference": {"job": second["id"]}}
    assert first["id"] not in users["bob"].post("/v1/comparisons", json=both).text


def test_request_is_kept_without_its_blanks(users: Users, folder: Path) -> None:
    compact = json.dumps({"scene": small(3)}, separators=(",", ":"))
    body = f'{{"scene": {json.dumps(small(3))}{" " * 200_000}}}'
    headers = {"Content-Type": "application/json", "Prefer": "wait=30"}
    for user, more in (("ann", {"Cache-Control": "no-cache"}), ("bob", {})):
        job = users[user].post("/v1/jobs", content=body, headers=headers | more).json()
        assert users[user].get(f"/v1/jobs/{job['id']}/request").text == compact
        kept = sum(path.stat().st_size for path in (folder / job["id"]).rglob("*") if path.is_file())
        assert kept < 100_000


def test_last_deletion_frees_the_disk(users: Users, folder: Path) -> None:
    first = ask(users["ann"], small(4), wait=30)
    second, third = (ask(users[user], small(4)) for user in ("bob", "eve"))
    for user, job in (("ann", first), ("bob", second)):
        assert users[user].delete(f"/v1/jobs/{job['id']}").status_code == 204
    assert image(users["eve"], third["id"]).shape == (32, 32, 3)
    assert (folder / first["id"] / "1-image.npy").exists()
    assert users["eve"].delete(f"/v1/jobs/{third['id']}").status_code == 204
    assert not (folder / first["id"]).exists()
    again = ask(users["bob"], small(4), wait=30)
    assert again["state"] == "succeeded"
    assert (folder / again["id"]).exists()


def test_jobs_under_way_share_one_render(users: Users, shared: Shared, folder: Path) -> None:
    first = ask(users["ann"], slow(6))
    wait(users["ann"], first["id"], lambda job: job["last_seq"] > 1)
    second, third = ask(users["bob"], slow(6)), ask(users["eve"], slow(6), time_limit=0.1)
    assert (second["state"], second["started_at"]) == ("running", second["created_at"])
    assert not (folder / second["id"]).exists()
    assert users["bob"].get(f"/v1/jobs/{second['id']}/tiles").json()["events"][0]["seq"] == 1
    database = Database(shared.url)
    with database.reading() as session:
        same = RenderRow.id.in_([job["id"] for job in (first, second, third)])
        assert session.scalar(select(func.count()).select_from(RenderRow).where(same)) == 1
    database.close()
    # One that runs out of time leaves the render to the others.
    late = wait(users["eve"], third["id"], ended)
    assert (late["state"], late["failure"]["code"]) == ("failed", "time_limit")
    # So does one that is cancelled, and its own events end.
    cancelled = users["ann"].post(f"/v1/jobs/{first['id']}/cancel").json()
    assert cancelled["state"] == "cancelled"
    assert users["ann"].get(f"/v1/jobs/{first['id']}/image.npy").status_code == 410
    after = wait(users["bob"], second["id"], lambda job: job["last_seq"] > cancelled["last_seq"])
    assert after["state"] == "running"
    assert job_of(users["ann"], first["id"])["progress"] == cancelled["progress"]
    # Cancelling the last one stops it, and nobody joins it.
    assert users["bob"].post(f"/v1/jobs/{second['id']}/cancel").json()["state"] == "cancelled"
    anew = ask(users["eve"], slow(6))
    assert anew["progress"]["done"] == 0
    users["eve"].post(f"/v1/jobs/{anew['id']}/cancel")
    until(lambda: not (folder / first["id"] / "tiles").exists())


def test_submissions_at_the_same_time_make_one_render(users: Users, folder: Path) -> None:
    before = set(folder.iterdir())
    with ThreadPoolExecutor(8) as pool:
        asked = [users[user] for user in ("ann", "bob") * 4]
        jobs = list(pool.map(lambda client: ask(client, small(9), wait=30), asked))
    assert len({job["id"] for job in jobs}) == 8
    assert {job["state"] for job in jobs} == {"succeeded"}
    (made,) = set(folder.iterdir()) - before
    assert made.name in {job["id"] for job in jobs}


def test_failed_render_is_tried_again(users: Users, folder: Path) -> None:
    mesh = b"v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 9\n"
    sha256 = hashlib.sha256(mesh).hexdigest()
    for user in ("ann", "bob"):
        assert users[user].put(f"/v1/assets/{sha256}", content=mesh).status_code == 200
    document = small(10)
    document["shapes"].append({"type": "mesh", "asset": f"sha256:{sha256}", "material": "ball"})
    jobs = [ask(users[user], document, wait=30) for user in ("ann", "bob")]
    assert [job["failure"]["code"] for job in jobs] == ["scene_not_usable"] * 2
    assert all((folder / job["id"]).exists() for job in jobs)
