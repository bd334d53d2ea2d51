"""A picture is rendered once for all users, without revealing them to each other."""

from __future__ import annotations

import copy
import hashlib
import json
from collections.abc import Callable, Iterator
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import httpx2
import numpy as np
import pytest
from sqlalchemy import func, select

from schemas.api.administration import Role
from schemas.api.jobs import JobRequest
from service.access import keys
from service.jobs.canonical import spec_of
from service.server import RunningServer, running
from service.settings import Settings
from service.storage.database.connection import Database
from service.storage.database.migrations import upgrade
from service.storage.database.models import RenderRow
from tests.service.support import KINDS, TIMEOUT, ended, image, job_of, long_scene, scene, until, wait

Users = dict[str, httpx2.Client]


@dataclass(frozen=True)
class Shared:
    """A server with the keys of its users, and the settings that it runs by."""

    server: RunningServer
    keys: dict[str, str]
    settings: Settings


@pytest.fixture(scope="module", params=KINDS)
def shared(request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory) -> Iterator[Shared]:
    data = tmp_path_factory.mktemp("shared")
    url = request.getfixturevalue("postgres").database() if request.param == "postgresql" else None
    settings = Settings(data=data, database=url, port=0, workers=1, tile_size=32, log_level="error")
    database = Database(settings.database_url)
    upgrade(database)
    with database.writing() as session:
        made = {user: str(keys.add(session, user, Role.SUBMIT)) for user in ("ann", "bob", "eve")}
    database.close()
    with running(settings) as server:
        yield Shared(server, made, settings)


@pytest.fixture
def users(shared: Shared) -> Iterator[Users]:
    url = shared.server.url
    clients = {
        user: httpx2.Client(base_url=url, timeout=TIMEOUT, headers={"Authorization": f"Bearer {key}"})
        for user, key in shared.keys.items()
    }
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


def running_shared(users: Users, number: int) -> tuple[dict[str, Any], dict[str, Any]]:
    """Two users' jobs that share a render under way."""
    first = ask(users["ann"], slow(number))
    wait(users["ann"], first["id"], lambda job: job["last_seq"] > 1)
    return first, ask(users["bob"], slow(number))


def test_what_was_rendered_is_answered_at_once(users: Users, folder: Path) -> None:
    first = ask(users["ann"], small(1), wait=30)
    second = ask(users["bob"], small(1), labels={"own": "yes"})
    assert (first["state"], second["state"]) == ("succeeded", "succeeded")
    assert second["id"] != first["id"]
    assert (second["labels"], first["labels"]) == ({"own": "yes"}, {})
    assert np.array_equal(image(users["bob"], second["id"]), image(users["ann"], first["id"]))
    assert not (folder / second["id"]).exists()
    batch = users["bob"].get(f"/v1/jobs/{second['id']}/tiles").json()
    assert [event["seq"] for event in batch["events"]] == list(range(1, second["last_seq"] + 1))
    assert batch["complete"]


def test_an_answer_from_the_store_reveals_no_earlier_user(users: Users) -> None:
    first = ask(users["ann"], small(2) | {"name": "secret"}, wait=30)
    second = ask(users["bob"], small(2))
    reported = users["bob"].get(f"/v1/jobs/{second['id']}").text
    assert "secret" not in reported
    assert "ann" not in reported
    assert second["started_at"] == second["finished_at"] == second["created_at"]
    for path in ("", "/tiles", "/plan", "/convergence", "/request", "/image.png"):
        answer = users["bob"].get(f"/v1/jobs/{second['id']}{path}")
        assert answer.status_code == 200, path
        assert first["id"].encode() not in answer.content, path
        assert first["id"] not in str(answer.headers), path
    both = {"image": {"job": second["id"]}, "reference": {"job": second["id"]}}
    assert first["id"] not in users["bob"].post("/v1/comparisons", json=both).text


def test_each_gets_back_what_he_has_sent(users: Users) -> None:
    bodies = [f'{{"scene": {json.dumps(small(3))}{blank}}}' for blank in ("", "  \n")]
    for user, body in zip(("ann", "bob"), bodies, strict=True):
        headers = {"Content-Type": "application/json", "Prefer": "wait=30"}
        job = users[user].post("/v1/jobs", content=body, headers=headers).json()
        assert users[user].get(f"/v1/jobs/{job['id']}/request").text == body


def test_deleting_one_leaves_the_others_and_the_last_frees_the_disk(users: Users, folder: Path) -> None:
    first = ask(users["ann"], small(4), wait=30)
    second, third = (ask(users[user], small(4)) for user in ("bob", "eve"))
    assert users["ann"].delete(f"/v1/jobs/{first['id']}").status_code == 204
    assert users["bob"].delete(f"/v1/jobs/{second['id']}").status_code == 204
    assert image(users["eve"], third["id"]).shape == (32, 32, 3)
    assert (folder / first["id"] / "1-image.npy").exists()
    assert users["eve"].delete(f"/v1/jobs/{third['id']}").status_code == 204
    assert not (folder / first["id"]).exists()
    again = ask(users["bob"], small(4), wait=30)
    assert again["state"] == "succeeded"
    assert (folder / again["id"]).exists()


def test_a_job_that_is_to_be_rendered_anew_shares_nothing(users: Users, folder: Path) -> None:
    ask(users["ann"], small(5), wait=30)
    headers = {"Cache-Control": "no-cache", "Prefer": "wait=30"}
    anew = users["ann"].post("/v1/jobs", json={"scene": small(5)}, headers=headers).json()
    assert anew["state"] == "succeeded"
    assert (folder / anew["id"] / "1-image.npy").exists()


def test_identical_submissions_under_way_share_one_render(users: Users, shared: Shared, folder: Path) -> None:
    first, second = running_shared(users, 6)
    assert second["state"] == "running"
    assert second["started_at"] == second["created_at"]
    assert not (folder / second["id"]).exists()
    seen = users["bob"].get(f"/v1/jobs/{second['id']}/tiles").json()["events"]
    assert seen[0]["seq"] == 1
    database = Database(shared.settings.database_url)
    with database.reading() as session:
        same = (
            select(func.count()).select_from(RenderRow).where(RenderRow.id.in_((first["id"], second["id"])))
        )
        assert session.scalar(same) == 1
    database.close()
    # Cancelling one of them leaves the render to the other, and ends its own events.
    cancelled = users["ann"].post(f"/v1/jobs/{first['id']}/cancel").json()
    assert cancelled["state"] == "cancelled"
    assert users["ann"].get(f"/v1/jobs/{first['id']}/image.npy").status_code == 410
    after = wait(users["bob"], second["id"], lambda job: job["last_seq"] > cancelled["last_seq"])
    assert after["state"] == "running"
    assert job_of(users["ann"], first["id"])["progress"] == cancelled["progress"]
    # Cancelling the last one stops it.
    stopped = users["bob"].post(f"/v1/jobs/{second['id']}/cancel").json()
    assert stopped["state"] == "cancelled"
    until(lambda: not (folder / first["id"] / "tiles").exists())


def test_identical_submissions_at_the_same_time_make_one_render(users: Users, folder: Path) -> None:
    before = set(folder.iterdir())
    with ThreadPoolExecutor(8) as pool:
        asked = [users[user] for user in ("ann", "bob") * 4]
        jobs = list(pool.map(lambda client: ask(client, small(9), wait=30), asked))
    assert len({job["id"] for job in jobs}) == 8
    assert {job["state"] for job in jobs} == {"succeeded"}
    (made,) = set(folder.iterdir()) - before
    assert made.name in {job["id"] for job in jobs}


def test_a_render_that_has_failed_is_tried_again(users: Users, folder: Path) -> None:
    mesh = b"v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 9\n"
    sha256 = hashlib.sha256(mesh).hexdigest()
    for user in ("ann", "bob"):
        assert users[user].put(f"/v1/assets/{sha256}", content=mesh).status_code == 200
    document = small(10)
    document["shapes"].append({"type": "mesh", "asset": f"sha256:{sha256}", "material": "ball"})
    jobs = [ask(users[user], document, wait=30) for user in ("ann", "bob")]
    assert [job["failure"]["code"] for job in jobs] == ["scene_not_usable"] * 2
    assert all((folder / job["id"]).exists() for job in jobs)


def test_one_that_runs_out_of_time_leaves_the_render_to_the_other(users: Users) -> None:
    first = ask(users["ann"], slow(7))
    wait(users["ann"], first["id"], lambda job: job["last_seq"] > 1)
    second = ask(users["bob"], slow(7), time_limit=0.1)
    late = wait(users["bob"], second["id"], ended)
    assert (late["state"], late["failure"]["code"]) == ("failed", "time_limit")
    assert job_of(users["ann"], first["id"])["state"] == "running"
    users["ann"].post(f"/v1/jobs/{first['id']}/cancel")


def test_a_cancelled_render_is_not_joined(users: Users) -> None:
    first = ask(users["ann"], slow(8))
    users["ann"].post(f"/v1/jobs/{first['id']}/cancel")
    second = ask(users["bob"], slow(8))
    assert second["progress"]["done"] == 0
    users["bob"].post(f"/v1/jobs/{second['id']}/cancel")


def edited(change: Callable[[dict[str, Any]], Any]) -> bytes:
    request = {"scene": copy.deepcopy(small(0))}
    change(request)
    return spec_of(JobRequest.model_validate(request)).content


SAME: dict[str, Callable[[dict[str, Any]], Any]] = {
    "the name of the scene": lambda request: request["scene"].update(name="other"),
    "labels": lambda request: request.update(labels={"a": "b"}),
    "priority": lambda request: request.update(priority=3),
    "the order of materials": lambda request: request["scene"].update(
        materials=dict(reversed(request["scene"]["materials"].items()))
    ),
    "a default that is written out": lambda request: request["scene"]["camera"].update(up=[0, 1, 0]),
    "whole numbers with a point": lambda request: request["scene"]["camera"].update(vertical_fov=40.0),
    "the samples as a quality": lambda request: request.update(
        quality={"mode": "fixed", "antialiasing": {"pattern": "uniform", "samples": 1}}
    ),
}
OTHER: dict[str, Callable[[dict[str, Any]], Any]] = {
    "the camera": lambda request: request["scene"]["camera"].update(vertical_fov=41),
    "more samples": lambda request: request.update(quality={"mode": "fixed", "light": {"samples": 4}}),
    "precision": lambda request: request.update(quality={"mode": "fixed", "precision": "double"}),
    "layers": lambda request: request.update(layers=["depth"]),
    "the display": lambda request: request["scene"].update(display={"exposure": 1}),
    "the seed": lambda request: request["scene"]["sampling"].update(seed=8),
    "the name of a shape": lambda request: request["scene"]["shapes"][0].update(name="other"),
    "a target": lambda request: request.update(quality={"mode": "target", "error": 0.01}),
}


@pytest.mark.parametrize("change", SAME.values(), ids=SAME)
def test_these_render_the_same(change: Callable[[dict[str, Any]], Any]) -> None:
    assert edited(change) == edited(lambda _: None)


@pytest.mark.parametrize("change", OTHER.values(), ids=OTHER)
def test_these_render_something_else(change: Callable[[dict[str, Any]], Any]) -> None:
    assert edited(change) != edited(lambda _: None)


QUALITIES: tuple[dict[str, Any], ...] = ({"precision": "double"}, {"error": 0.01}, {"mode": "fixed"})


@pytest.mark.parametrize("quality", QUALITIES, ids=str)
def test_what_is_kept_to_be_rendered_can_be_read_again(quality: dict[str, Any]) -> None:
    spec = edited(lambda request: request.update(quality=quality))
    again = JobRequest.model_validate_json(spec)
    assert spec_of(again).content == spec
