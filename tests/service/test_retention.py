"""Retention on the disk of a real server: by age, by size, pinned, and on request."""

from __future__ import annotations

import hashlib
from collections.abc import Iterator
from datetime import UTC, datetime, timedelta
from pathlib import Path
from typing import Any

import httpx2
import pytest
from sqlalchemy import text

from schemas.api.administration import Role
from schemas.api.jobs import JobState
from schemas.limits import Limits
from service.access import keys
from service.client import Client
from service.client.errors import NotAllowedError
from service.jobs.retention import RetentionThread, Rules
from service.server import RunningServer, running
from service.settings import Settings
from service.storage.assets import AssetStore
from service.storage.database.connection import Database
from service.storage.database.migrations import upgrade
from service.storage.database.models import AssetRow, RenderRow
from service.storage.folder import Folder
from service.storage.reserve import Reserve
from service.storage.tiles import TileStore
from tests.service.conftest import Start
from tests.service.support import TIMEOUT, job_with, scene, until
from tests.service.test_assets import png, put, textured

Users = dict[str, httpx2.Client]
ROLES = {"ann": Role.SUBMIT, "bob": Role.SUBMIT, "tutor": Role.STAFF, "root": Role.ADMIN}
EVERYTHING = {"max_stored_bytes": 0, "keep_asset_seconds": 0, "dry_run": False}
PINS = 3


@pytest.fixture(scope="module")
def keeping(tmp_path_factory: pytest.TempPathFactory) -> Iterator[tuple[RunningServer, dict[str, str]]]:
    data = tmp_path_factory.mktemp("kept")
    database = Database(Settings(data=data).database_url)
    upgrade(database)
    with database.writing() as session:
        made = {user: str(keys.add(session, user, role)) for user, role in ROLES.items()}
    database.close()
    settings = Settings(data=data, port=0, workers=1, tile_size=32, log_level="error", max_user_pins=PINS)
    with running(settings) as server:
        yield server, made


@pytest.fixture
def users(keeping: tuple[RunningServer, dict[str, str]]) -> Iterator[Users]:
    """A client for each user of a service that keeps nothing yet."""
    server, made = keeping
    clients = {
        user: httpx2.Client(base_url=server.url, timeout=TIMEOUT, headers={"Authorization": f"Bearer {key}"})
        for user, key in made.items()
    }
    for job in clients["root"].get("/v1/jobs", params={"limit": 100}).json()["jobs"]:
        assert clients["root"].delete(f"/v1/jobs/{job['id']}").status_code == 204
    assert clients["root"].post("/v1/prune", json=EVERYTHING).status_code == 200
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


def rendered(client: httpx2.Client, place: float, document: dict[str, Any] | None = None) -> dict[str, Any]:
    """A finished job, each place another picture."""
    asked = document or scene(32, 32, samples=1, light_samples=1)
    asked["camera"]["position"][0] = place
    job = client.post("/v1/jobs", json={"scene": asked}, headers={"Prefer": "wait=30"}).json()
    assert job["state"] == "succeeded", job
    return job


def states(client: httpx2.Client, *jobs: dict[str, Any]) -> list[str]:
    return [client.get(f"/v1/jobs/{job['id']}").json().get("state", "gone") for job in jobs]


def prune(users: Users, **rules: Any) -> dict[str, Any]:
    answer = users["root"].post("/v1/prune", json=rules)
    assert answer.status_code == 200, answer.text
    return answer.json()


def test_beyond_the_bytes_that_are_kept_the_oldest_pictures_go_first(users: Users, data: Path) -> None:
    jobs = [rendered(users["ann"], place) for place in range(4)]
    sizes = [size for name, size in files(data).items() if name.startswith(f"jobs/{jobs[3]['id']}/")]
    reported = prune(users, max_stored_bytes=2 * sum(sizes) + sum(sizes) // 2, dry_run=False)
    assert reported["expired"] == [job["id"] for job in jobs[:2]]
    assert states(users["ann"], *jobs) == ["expired", "expired", "succeeded", "succeeded"]
    assert {Path(name).parts[1] for name in files(data)} == {job["id"] for job in jobs[2:]}


def test_a_dry_run_reports_what_would_go_and_leaves_it(users: Users, data: Path) -> None:
    jobs = [rendered(users["ann"], place) for place in range(2)]
    before = files(data)
    reported = prune(users, max_stored_bytes=0)
    assert (reported["dry_run"], reported["pictures"], reported["bytes"]) == (True, 2, sum(before.values()))
    assert files(data) == before
    assert states(users["ann"], *jobs) == ["succeeded", "succeeded"]
    done = prune(users, max_stored_bytes=0, dry_run=False)
    assert done == reported | {"dry_run": False}
    assert files(data) == {}


def test_what_is_encoded_later_counts_too(users: Users, data: Path) -> None:
    asked = {"scene": scene(32, 32, samples=1, light_samples=1), "layers": ["depth"]}
    job = users["ann"].post("/v1/jobs", json=asked, headers={"Prefer": "wait=30"}).json()
    for name in ("image.png", "image.exr", "image.png?width=96", "image.png"):
        assert users["ann"].get(f"/v1/jobs/{job['id']}/{name}").status_code == 200
    kept = files(data)
    assert {Path(name).suffix for name in kept} == {".json", ".npy", ".png", ".exr"}
    assert prune(users, max_stored_bytes=0)["bytes"] == sum(kept.values())


def test_a_picture_goes_once_the_pin_of_another_job_is_gone(users: Users, data: Path) -> None:
    first, second = (rendered(users[user], 1) for user in ("ann", "bob"))
    users["bob"].put(f"/v1/jobs/{second['id']}/pin")
    assert users["bob"].delete(f"/v1/jobs/{second['id']}").status_code == 204
    assert prune(users, max_stored_bytes=0, dry_run=False)["expired"] == [first["id"]]
    assert files(data) == {}


def test_a_pinned_job_is_never_swept(users: Users, data: Path) -> None:
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


def test_a_picture_that_one_job_has_pinned_stays_for_it_when_the_other_job_is_too_old(users: Users) -> None:
    first, second = (rendered(users[user], 1) for user in ("ann", "bob"))
    users["bob"].put(f"/v1/jobs/{second['id']}/pin")
    assert prune(users, max_stored_bytes=0)["pictures"] == 0
    reported = prune(users, keep_seconds=0, dry_run=False)
    assert (reported["pictures"], reported["bytes"]) == (0, 0)
    assert states(users["root"], first, second) == ["gone", "succeeded"]
    assert users["bob"].get(f"/v1/jobs/{second['id']}/image.npy").status_code == 200


def test_owners_and_staff_pin_and_others_do_not_see_the_job(users: Users) -> None:
    job = rendered(users["ann"], 1)
    answers = {user: client.put(f"/v1/jobs/{job['id']}/pin").status_code for user, client in users.items()}
    assert answers == {"ann": 200, "bob": 404, "tutor": 200, "root": 200}
    assert users["bob"].delete(f"/v1/jobs/{job['id']}/pin").status_code == 404
    assert users["ann"].get(f"/v1/jobs/{job['id']}").json()["pinned"]


def test_a_user_pins_as_many_jobs_as_he_may_and_staff_more(users: Users) -> None:
    jobs = [rendered(users["ann"], place) for place in range(PINS + 1)]
    answers = [users["ann"].put(f"/v1/jobs/{job['id']}/pin").status_code for job in jobs]
    assert answers == [200] * PINS + [403]
    assert users["ann"].put(f"/v1/jobs/{jobs[0]['id']}/pin").status_code == 200
    assert users["tutor"].put(f"/v1/jobs/{jobs[-1]['id']}/pin").status_code == 200


def test_what_has_expired_is_not_pinned_any_more(users: Users) -> None:
    job = rendered(users["ann"], 1)
    prune(users, max_stored_bytes=0, dry_run=False)
    assert users["ann"].put(f"/v1/jobs/{job['id']}/pin").status_code == 410


def test_an_asset_stays_while_a_picture_needs_it_and_goes_after_that(users: Users, data: Path) -> None:
    content = png(6, 5)
    name = hashlib.sha256(content).hexdigest()
    for user in ("ann", "bob"):
        put(users[user], content)
    first, second = (rendered(users[user], 2, textured(f"sha256:{name}")) for user in ("ann", "bob"))
    assert users["ann"].delete(f"/v1/jobs/{first['id']}").status_code == 204
    assert prune(users, keep_asset_seconds=0, dry_run=False)["assets"] == []
    assert users["bob"].delete(f"/v1/jobs/{second['id']}").status_code == 204
    assert files(data) == {f"assets/{name}": len(content)}
    reported = prune(users, keep_asset_seconds=0, dry_run=False)
    assert (reported["assets"], reported["bytes"]) == ([name], len(content))
    assert files(data) == {}
    assert users["ann"].head(f"/v1/assets/{name}").status_code == 404
    # It comes back when it is sent again.
    assert put(users["ann"], content).status_code == 200
    assert rendered(users["ann"], 2, textured(f"sha256:{name}"))["state"] == "succeeded"


def test_an_asset_that_was_sent_just_now_is_kept_for_the_job_that_will_need_it(users: Users) -> None:
    content = png(3, 3)
    name = hashlib.sha256(content).hexdigest()
    put(users["ann"], content)
    assert prune(users, max_stored_bytes=0, dry_run=False)["assets"] == []
    assert users["ann"].head(f"/v1/assets/{name}").status_code == 200


def test_only_admins_prune(users: Users) -> None:
    answers = {user: client.post("/v1/prune", json={}).status_code for user, client in users.items()}
    assert answers == {"ann": 403, "bob": 403, "tutor": 403, "root": 200}


def test_rules_that_make_no_sense_are_refused(users: Users) -> None:
    for rules in ({"keep_seconds": -1}, {"max_stored_bytes": 1.5}, {"unknown": 1}):
        answer = users["root"].post("/v1/prune", json=rules)
        assert answer.status_code == 422
        assert answer.json()["errors"][0]["pointer"] == f"/{next(iter(rules))}"


def test_the_client_pins_and_prunes(keeping: tuple[RunningServer, dict[str, str]], users: Users) -> None:
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


def test_many_jobs_go_as_few_do_though_one_of_each_age_is_damaged(database: Database, tmp_path: Path) -> None:
    """So many go in several transactions, and in a dry run in one."""
    days, assets = [1] * 2 + [15] * 103 + [40] * 103, 120
    with database.writing() as session:
        for number, age in enumerate(days):
            ended = datetime.now(UTC) - timedelta(days=age, seconds=number)
            render = RenderRow(
                id=f"job-{number}",
                state=JobState.SUCCEEDED,
                width=1,
                height=1,
                spec_sha256="",
                passes=[{"index": 0, "stride": 1, "first": 0, "last": 1}],
                display={},
                total_steps=0,
                total_work=1,
                predicted_cpu_seconds=1.0,
                numerics={},
                pass_costs=[],
                stored_bytes=1,
                idle_since=ended,
            )
            session.add(job_with(render.id, render, state=JobState.SUCCEEDED, finished_at=ended))
        for number in range(assets):
            session.add(
                AssetRow(
                    sha256=f"{number:064x}",
                    bytes=2,
                    media_type="image/png",
                    width=1,
                    height=1,
                    created_at=ended,
                    used_at=ended,
                )
            )
        session.flush()
        session.execute(text("UPDATE jobs SET quality = '{' WHERE id IN ('job-104', 'job-207')"))
    rules = Rules(keep_seconds=10 * 86400.0, keep_asset_seconds=86400.0)
    objects = Folder(tmp_path / "objects")
    store, kept = TileStore(objects), AssetStore(objects.within("assets"), Limits())
    thread = RetentionThread(database, store, kept, rules, Reserve(tmp_path, database))
    once, often = thread.predict(rules), thread.prune(rules)
    for swept in (once, often):
        assert set(swept.expired) == {f"job-{number}" for number in range(2, 104)}
        assert set(swept.forgotten) == {f"job-{number}" for number in range(105, 207)}
    assert (once.pictures, once.assets, once.bytes) == (often.pictures, often.assets, often.bytes)
    assert often.bytes == 204 + 2 * assets


@pytest.mark.slow
def test_a_service_sweeps_by_itself_and_starts_without_what_a_killed_one_left(
    start: Start, tmp_path: Path
) -> None:
    orphan = tmp_path / "assets" / hashlib.sha256(b"orphan").hexdigest()
    orphan.parent.mkdir()
    orphan.write_bytes(b"orphan")
    server = start(workers=1, keep_seconds=1.0, keep_asset_seconds=1e-3)
    assert not orphan.exists()
    with httpx2.Client(base_url=server.url, timeout=TIMEOUT) as client:
        content = png(4, 4)
        put(client, content)
        kept, swept = (rendered(client, place) for place in range(2))
        client.put(f"/v1/jobs/{kept['id']}/pin")
        while states(client, swept) != ["gone"]:
            client.get(f"/v1/jobs/{kept['id']}/tiles", params={"after": kept["last_seq"], "wait": 0})
        assert states(client, kept) == ["succeeded"]
    assert {Path(name).parts[1] for name in files(tmp_path)} == {kept["id"]}
