"""Retention on the disk of a real server: by age, by size, pinned, and on request."""

import hashlib
import os
import sqlite3
from collections.abc import Iterator
from contextlib import closing
from datetime import UTC, datetime, timedelta
from pathlib import Path
from typing import Any

import httpx2
import pytest
from sqlalchemy import select, text

from schemas.api.administration import Role
from schemas.api.jobs import JobState
from schemas.limits import Limits
from service.client import Client
from service.client.errors import NotAllowedError
from service.jobs.retention import RetentionThread
from service.jobs.sweep import Rules
from service.server import RunningServer
from service.settings import Settings
from service.storage.assets import AssetStore
from service.storage.database.connection import Database
from service.storage.database.models import AssetRow, AssetUseRow, JobRow
from service.storage.folder import Folder
from service.storage.reserve import Reserve
from service.storage.tiles import TileStore
from tests.service.conftest import Start
from tests.service.forking import running
from tests.service.sending import client_of, make_keys
from tests.service.support import BOTH, job_with, pictured, scene, until

Users = dict[str, httpx2.Client]
ROLES = {"ann": Role.SUBMIT, "bob": Role.SUBMIT, "tutor": Role.STAFF, "root": Role.ADMIN}
PINS = 3
MESH = b"v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n"
NAME = hashlib.sha256(MESH).hexdigest()
TEN_YEARS = timedelta(days=3652)


@pytest.fixture(scope="module")
def keeping(tmp_path_factory: pytest.TempPathFactory) -> Iterator[tuple[RunningServer, dict[str, str]]]:
    data = tmp_path_factory.mktemp("kept")
    made = make_keys(data, **ROLES)
    settings = Settings(data=data, port=0, workers=1, tile_size=32, log_level="error", max_user_pins=PINS)
    with running(settings) as server:
        yield server, made


@pytest.fixture
def users(keeping: tuple[RunningServer, dict[str, str]]) -> Iterator[Users]:
    """A client for each user of a service that keeps nothing yet."""
    server, made = keeping
    clients = {user: client_of(server, key) for user, key in made.items()}
    for job in clients["root"].get("/v1/jobs", params={"limit": 100}).json()["jobs"]:
        assert clients["root"].delete(f"/v1/jobs/{job['id']}").status_code == 204
    prune(clients, max_stored_bytes=0, keep_asset_seconds=0, dry_run=False)
    yield clients
    for client in clients.values():
        client.close()


@pytest.fixture
def data(keeping: tuple[RunningServer, dict[str, str]]) -> Path:
    return keeping[0].data


def files(data: Path) -> dict[str, int]:
    """Every file that is kept for jobs, with its bytes, once the tiles of finished ones are gone."""
    until(lambda: not any((data / "jobs").glob("*/tiles")))
    found = [path for name in ("jobs", "assets") for path in (data / name).rglob("*") if path.is_file()]
    return {str(path.relative_to(data)): path.stat().st_size for path in found}


def rendered(client: httpx2.Client, place: float, *, mesh: bool = False, **request: Any) -> dict[str, Any]:
    """A finished job, each place another picture."""
    asked = scene(32, 32, samples=1, light_samples=1)
    asked["camera"]["position"][0] = place
    if mesh:
        asked["shapes"].append({"type": "mesh", "asset": f"sha256:{NAME}", "material": "ball"})
    body = {"scene": asked, **request}
    job = client.post("/v1/jobs", json=body, headers={"Prefer": "wait=30"}).json()
    assert job["state"] == "succeeded", job
    return job


def send(client: httpx2.Client) -> None:
    assert client.put(f"/v1/assets/{NAME}", content=MESH).status_code == 200


def states(client: httpx2.Client, *jobs: dict[str, Any]) -> list[str]:
    return [client.get(f"/v1/jobs/{job['id']}").json().get("state", "gone") for job in jobs]


def pin(client: httpx2.Client, job: dict[str, Any]) -> int:
    return client.put(f"/v1/jobs/{job['id']}/pin").status_code


def prune(users: Users, **rules: Any) -> dict[str, Any]:
    answer = users["root"].post("/v1/prune", json=rules)
    assert answer.status_code == 200, answer.text
    return answer.json()


def test_oldest_pictures_go_first_of_whoever_has_most(users: Users, data: Path) -> None:
    others = [rendered(users["bob"], 4)]
    jobs = [rendered(users["ann"], place) for place in range(4)]
    # Both have the first one, which bob has wanted last.
    others.append(rendered(users["bob"], 0))
    size = sum(size for name, size in files(data).items() if name.startswith(f"jobs/{jobs[3]['id']}/"))
    reported = prune(users, max_stored_bytes=3 * size + size // 2, dry_run=False)
    assert reported["expired"] == [job["id"] for job in jobs[1:3]]
    assert states(users["ann"], *jobs) == ["succeeded", "expired", "expired", "succeeded"]
    assert states(users["bob"], *others) == ["succeeded", "succeeded"]
    assert {Path(name).parts[1] for name in files(data)} == {
        job["id"] for job in (others[0], jobs[0], jobs[3])
    }
    assert pin(users["ann"], jobs[1]) == 410


def test_history_of_an_expired_job_stays(users: Users) -> None:
    path = f"/v1/jobs/{rendered(users['ann'], 5, quality={'mode': 'target', 'error': 0.05})['id']}"
    log, course = (users["ann"].get(f"{path}/{part}").json() for part in ("log", "convergence"))
    prune(users, max_stored_bytes=0, dry_run=False)
    *before, expired = users["ann"].get(f"{path}/log").json()["entries"]
    assert before == log["entries"]
    assert [entry["event"] for entry in before][-2:] == ["pass_finished", "succeeded"]
    assert expired["event"] == "expired"
    assert expired["at"] > before[-1]["at"]
    assert users["ann"].get(f"{path}/convergence").json() == course | {"state": "expired"}


def test_dry_run_reports_what_would_go(users: Users, data: Path) -> None:
    jobs = [rendered(users["ann"], place, layers=["depth"]) for place in range(2)]
    # What is encoded later counts too.
    for name in ("image.png", "image.exr", "image.png?width=96", "image.png"):
        assert users["ann"].get(f"/v1/jobs/{jobs[0]['id']}/{name}").status_code == 200
    before = files(data)
    assert {Path(name).suffix for name in before} == {".json", ".npy", ".png", ".exr"}
    # It writes nothing, and neither waits for others nor has others wait.
    with closing(sqlite3.connect(data / "penumbra.sqlite")) as connection:
        connection.execute("PRAGMA busy_timeout = 10000")
        connection.execute("BEGIN IMMEDIATE")
        reported = prune(users, max_stored_bytes=0)
    assert (reported["dry_run"], reported["pictures"], reported["bytes"]) == (True, 2, sum(before.values()))
    assert files(data) == before
    assert states(users["ann"], *jobs) == ["succeeded", "succeeded"]
    assert prune(users, max_stored_bytes=0, dry_run=False) == reported | {"dry_run": False}
    assert files(data) == {}


def test_pinned_job_is_never_swept(users: Users, data: Path) -> None:
    pinned, other = (rendered(users["ann"], place) for place in range(2))
    assert pinned["expires_at"] is not None
    reported = users["ann"].put(f"/v1/jobs/{pinned['id']}/pin").json()
    assert (reported["pinned"], reported["expires_at"]) == (True, None)
    prune(users, keep_seconds=0, max_stored_bytes=0, dry_run=False)
    assert states(users["ann"], pinned, other) == ["succeeded", "gone"]
    assert users["ann"].get(f"/v1/jobs/{pinned['id']}/image.npy").status_code == 200
    freed = users["ann"].delete(f"/v1/jobs/{pinned['id']}/pin").json()
    assert (freed["pinned"], freed["expires_at"]) == (False, pinned["expires_at"])
    prune(users, max_stored_bytes=0, dry_run=False)
    assert states(users["ann"], pinned) == ["expired"]
    assert files(data) == {}


def test_pin_of_one_job_keeps_a_shared_picture(users: Users, data: Path) -> None:
    first, second = (rendered(users[user], 1) for user in ("ann", "bob"))
    assert [pin(users["ann"], first), pin(users["bob"], second)] == [200, 200]
    assert users["ann"].delete(f"/v1/jobs/{first['id']}/pin").status_code == 200
    assert prune(users, max_stored_bytes=0)["pictures"] == 0
    reported = prune(users, keep_seconds=0, dry_run=False)
    assert (reported["pictures"], reported["bytes"]) == (0, 0)
    assert states(users["root"], first, second) == ["gone", "succeeded"]
    assert users["bob"].get(f"/v1/jobs/{second['id']}/image.npy").status_code == 200
    # Once that job is gone, the picture is like any other.
    third = rendered(users["ann"], 1)
    assert users["bob"].delete(f"/v1/jobs/{second['id']}").status_code == 204
    assert prune(users, max_stored_bytes=0, dry_run=False)["expired"] == [third["id"]]
    assert files(data) == {}


def test_pins_are_for_owners_and_staff_and_counted(users: Users) -> None:
    jobs = [rendered(users["ann"], place) for place in range(PINS + 1)]
    assert pin(users["bob"], jobs[0]) == 404
    assert users["bob"].delete(f"/v1/jobs/{jobs[0]['id']}/pin").status_code == 404
    assert [pin(users["ann"], job) for job in jobs] == [200] * PINS + [403]
    assert pin(users["ann"], jobs[0]) == 200
    assert [pin(users[user], jobs[-1]) for user in ("tutor", "root")] == [200, 200]


def test_asset_stays_while_a_picture_needs_it(users: Users, data: Path) -> None:
    for user in ("ann", "bob"):
        send(users[user])
    # One that was sent just now is kept for the job that will need it.
    assert prune(users, max_stored_bytes=0, dry_run=False)["assets"] == []
    first, second = (rendered(users[user], 2, mesh=True) for user in ("ann", "bob"))
    assert users["ann"].delete(f"/v1/jobs/{first['id']}").status_code == 204
    assert prune(users, keep_asset_seconds=0, dry_run=False)["assets"] == []
    assert users["bob"].delete(f"/v1/jobs/{second['id']}").status_code == 204
    assert files(data) == {f"assets/{NAME}": len(MESH)}
    reported = prune(users, keep_asset_seconds=0, dry_run=False)
    assert (reported["assets"], reported["bytes"]) == ([NAME], len(MESH))
    assert files(data) == {}
    assert users["ann"].head(f"/v1/assets/{NAME}").status_code == 404
    # It comes back when it is sent again.
    send(users["ann"])
    assert rendered(users["ann"], 2, mesh=True)["state"] == "succeeded"


def test_prune_is_for_admins_with_usable_rules(users: Users) -> None:
    answers = {user: client.post("/v1/prune", json={}).status_code for user, client in users.items()}
    assert answers == {"ann": 403, "bob": 403, "tutor": 403, "root": 200}
    for rules in ({"keep_seconds": -1}, {"max_stored_bytes": 1.5}, {"unknown": 1}):
        answer = users["root"].post("/v1/prune", json=rules)
        assert answer.status_code == 422
        assert answer.json()["errors"][0]["pointer"] == f"/{next(iter(rules))}"


def test_client_pins_and_prunes(keeping: tuple[RunningServer, dict[str, str]], users: Users) -> None:
    server, made = keeping
    with Client(server.url, key=made["root"]) as root, Client(server.url, key=made["ann"]) as ann:
        job = ann.submit(scene(24, 16, samples=1, light_samples=1)).wait()
        assert job.pin().pinned
        assert root.prune(max_stored_bytes=0).expired == ()
        assert not job.unpin().pinned
        assert root.prune(max_stored_bytes=0).expired == (job.id,)
        assert root.get(job.id).state == "succeeded"
        assert root.prune(max_stored_bytes=0, dry_run=False).expired == (job.id,)
        assert ann.get(job.id).state == "expired"
        with pytest.raises(NotAllowedError):
            ann.prune()


@pytest.mark.slow
@BOTH
def test_many_jobs_go_though_some_are_damaged(database: Database, tmp_path: Path) -> None:
    """So many go in several transactions, and in a dry run in one. PostgreSQL stores no such damage."""
    damaged = set() if database.shared else {"job-104", "job-207"}
    days, assets = [1] * 2 + [15] * 103 + [40] * 103, 120
    size = {"media_type": "image/png", "width": 1, "height": 1}
    with database.writing() as session:
        for number, age in enumerate(days):
            ended = datetime.now(UTC) - timedelta(days=age, seconds=number)
            render = pictured(f"job-{number}", stored_bytes=1, idle_since=ended)
            session.add(job_with(render.id, render, state=JobState.SUCCEEDED, finished_at=ended))
        for number in range(assets):
            session.add(AssetRow(sha256=f"{number:064x}", bytes=2, created_at=ended, used_at=ended, **size))
        session.flush()
        if damaged:
            session.execute(text("UPDATE jobs SET quality = '{' WHERE id IN ('job-104', 'job-207')"))
    rules = Rules(keep_seconds=10 * 86400.0, keep_asset_seconds=86400.0)
    objects = Folder(tmp_path / "objects")
    store, kept = TileStore(objects), AssetStore(objects.within("assets"), Limits())
    thread = RetentionThread(database, store, kept, rules, Reserve(tmp_path, database))
    once, often = thread.predict(rules), thread.prune(rules)
    for swept in (once, often):
        assert set(swept.expired) == {f"job-{number}" for number in range(2, 105)} - damaged
        assert set(swept.forgotten) == {f"job-{number}" for number in range(105, 208)} - damaged
    assert (once.pictures, once.assets, once.bytes) == (often.pictures, often.assets, often.bytes)
    assert often.bytes == 206 - len(damaged) + 2 * assets


@BOTH
def test_asset_stays_that_an_earlier_server_has_not_counted(database: Database, tmp_path: Path) -> None:
    """Version 0.1 enters what a render needs, and no count of it."""
    ended = datetime.now(UTC) - timedelta(days=9)
    render = pictured("job")
    used, unused = "a" * 64, "b" * 64
    with database.writing() as session:
        session.add(job_with("job", render, state=JobState.SUCCEEDED, finished_at=ended))
        for name in (used, unused):
            size = {"bytes": 2, "media_type": "image/png", "width": 1, "height": 1}
            session.add(AssetRow(sha256=name, created_at=ended, used_at=ended, **size))
        session.flush()
        session.add(AssetUseRow(render=render.number, sha256=used))
    objects = Folder(tmp_path / "objects")
    kept = AssetStore(objects.within("assets"), Limits())
    thread = RetentionThread(database, TileStore(objects), kept, Rules(), Reserve(tmp_path, database))
    rules = Rules(keep_asset_seconds=0.0)
    assert [list(thread.prune(rules).assets) for _ in range(2)] == [[unused], []]
    # Once it is counted, it goes with the picture.
    assert list(thread.prune(Rules(keep_seconds=1.0, keep_asset_seconds=0.0)).assets) == [used]


@pytest.mark.slow
def test_clock_ten_years_ahead_deletes_nothing_by_itself(tmp_path: Path) -> None:
    """For a service it is the same whether the clock is ahead, or all that it has is old."""
    data, log = tmp_path / "data", tmp_path / "log"
    common = {"data": data, "port": 0, "workers": 1, "log_level": "warning"}
    with running(Settings(**common)) as server, client_of(server) as client:
        jobs = [rendered(client, place) for place in range(2)]
        send(client)
    database = Database(Settings(data=data).database_url)
    with database.writing() as session:
        for job in session.scalars(select(JobRow)):
            job.created_at, job.finished_at = job.created_at - TEN_YEARS, job.finished_at - TEN_YEARS
        for asset in session.scalars(select(AssetRow)):
            asset.used_at -= TEN_YEARS
        session.execute(text("DELETE FROM totals WHERE name = 'swept_at'"))
    database.close()
    with (
        log.open("wb") as stderr,
        running(Settings(**common, keep_seconds=1.0), stderr=stderr) as server,
        client_of(server) as client,
    ):
        until(lambda: "clock jumped" in log.read_text())
        assert "penumbra prune" in log.read_text()
        assert states(client, *jobs) == ["succeeded", "succeeded"]
        pruned = client.post("/v1/prune", json={"dry_run": False}).json()
        assert (set(pruned["forgotten"]), pruned["assets"]) == ({job["id"] for job in jobs}, [NAME])
        # From then on the clock is believed.
        swept = rendered(client, 3)
        until(lambda: states(client, swept) == ["gone"])


@pytest.mark.slow
def test_service_sweeps_by_itself(start: Start, tmp_path: Path) -> None:
    orphan = tmp_path / "assets" / hashlib.sha256(b"orphan").hexdigest()
    orphan.parent.mkdir()
    orphan.write_bytes(b"orphan")
    os.utime(orphan, (0, 0))
    server = start(workers=1, keep_seconds=1.0, keep_asset_seconds=1.0)
    assert not orphan.exists()
    with client_of(server) as client:
        send(client)
        kept, swept = (rendered(client, place) for place in range(2))
        assert pin(client, kept) == 200
        until(lambda: states(client, swept) == ["gone"])
        assert states(client, kept) == ["succeeded"]
    assert {Path(name).parts[1] for name in files(tmp_path)} == {kept["id"]}
