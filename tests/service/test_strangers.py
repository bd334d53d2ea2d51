"""Access control of every route; the list of routes is that of the application."""

from __future__ import annotations

import hashlib
import re
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

import httpx2
import pytest
from fastapi.routing import iter_route_contexts

from schemas.api.administration import Role
from service.access import keys
from service.app import create_app
from service.server import running
from service.settings import Settings
from service.storage.database.connection import Database
from service.storage.database.migrations import upgrade
from tests.service.support import TIMEOUT
from tests.service.test_assets import png, textured
from tests.service.test_meshes import FILES, with_mesh

# Public: it shows nothing of any user.
PUBLIC = {
    "/livez",
    "/readyz",
    "/version",
    "/openapi.json",
    "/",
    "/jobs",
    "/jobs/{job_id}",
    "/compare",
    "/compare/{a}/{b}",
    "/web/{path:path}",
    "/gallery/{path:path}",
    "/docs",
}
# Ids in an address: on every route those of another user must not be found.
THINGS = {"job_id", "sha256"}
# Other parts of an address.
PARTS = {"name"}
MISSING = {"job_id": "0123456789abcdef", "sha256": "0" * 64}
"""Names that nothing has."""


def routes() -> list[tuple[str, str]]:
    """Every method with every address that the application answers."""
    contexts = iter_route_contexts(create_app(Settings()).routes)
    return sorted((method, str(route.path)) for route in contexts for method in route.methods or ())


PRIVATE = [(method, path) for method, path in routes() if path not in PUBLIC]
OWNED = [(method, path) for method, path in PRIVATE if THINGS & set(re.findall(r"{(\w+)", path))]


@dataclass
class World:
    """A service with keys, and what ann has there."""

    url: str
    secrets: dict[str, str]
    things: dict[str, str]
    mesh: str

    def ask(self, user: str | None, method: str, path: str, **request: Any) -> httpx2.Response:
        headers = request.pop("headers", {})
        headers |= {"Authorization": f"Bearer {self.secrets[user]}"} if user else {}
        return httpx2.request(method, self.url + path, headers=headers, timeout=TIMEOUT, **request)


@pytest.fixture(scope="module")
def world(tmp_path_factory: pytest.TempPathFactory) -> Iterator[World]:
    settings = Settings(
        data=tmp_path_factory.mktemp("strangers"),
        port=0,
        workers=1,
        log_level="error",
        max_user_asset_bytes=60_000,
        max_asset_bytes=50_000,
    )
    database = Database(settings.database_url)
    upgrade(database)
    roles = {"ann": Role.SUBMIT, "bob": Role.SUBMIT, "eve": Role.SUBMIT, "tutor": Role.STAFF}
    with database.writing() as session:
        secrets = {user: str(keys.add(session, user, role)) for user, role in roles.items()}
    database.close()
    with running(settings) as server:
        there = World(server.url, secrets, {}, "")
        names = [
            upload(there, "ann", content).json()["name"] for content in (png(9, 9), FILES["ply binary"]())
        ]
        document = textured(names[0])
        job = there.ask(
            "ann", "POST", "/v1/jobs", json={"scene": document}, headers={"Prefer": "wait=30"}
        ).json()
        assert job["state"] == "succeeded"
        there.things = {"job_id": job["id"], "sha256": names[0].removeprefix("sha256:")}
        there.mesh = names[1]
        yield there


def upload(world: World, user: str, content: bytes) -> httpx2.Response:
    return world.ask(user, "PUT", f"/v1/assets/{hashlib.sha256(content).hexdigest()}", content=content)


def filled(path: str, things: dict[str, str]) -> str:
    return path.format(**{"name": "depth"} | things)


def test_every_part_of_an_address_is_known_to_these_tests() -> None:
    parts = {part for _, path in PRIVATE for part in re.findall(r"{(\w+)", path)}
    assert parts <= THINGS | PARTS, "say whether the new part names a thing that belongs to a user"
    assert len(OWNED) > 20


@pytest.mark.parametrize(("method", "path"), PRIVATE)
def test_a_route_answers_nothing_without_a_key(world: World, method: str, path: str) -> None:
    answer = world.ask(None, method, filled(path, world.things), content=b"{}")
    assert answer.status_code == 401
    assert answer.headers["WWW-Authenticate"] == "Bearer"


@pytest.mark.parametrize(("method", "path"), [each for each in OWNED if each[0] != "PUT"])
def test_what_another_user_owns_is_answered_like_what_does_not_exist(
    world: World, method: str, path: str
) -> None:
    body = {} if method in {"GET", "HEAD", "DELETE"} else {"json": {"x": 0, "y": 0}}
    foreign = world.ask("bob", method, filled(path, world.things), **body)
    missing = world.ask("bob", method, filled(path, MISSING), **body)
    assert foreign.status_code == 404
    assert (foreign.status_code, foreign.text) == (missing.status_code, missing.text)
    assert set(foreign.headers) == set(missing.headers)
    # The address was right: the job is there for its owner, who has not requested this layer.
    if method != "DELETE":
        allowed = world.ask("ann", method, filled(path, world.things), **body)
        assert allowed.status_code != 404 or path.endswith("/layers/{name}.npy")


@pytest.mark.parametrize("path", ["/v1/jobs", "/v1/plans", "/v1/quotes"])
def test_a_scene_names_no_files_of_others(world: World, path: str) -> None:
    for document, place in (
        (textured(f"sha256:{world.things['sha256']}"), "/scene/textures/a~1b/asset"),
        (with_mesh(FILES["ply binary"]()), "/scene/shapes/1/asset"),
    ):
        refused = world.ask("bob", "POST", path, json={"scene": document})
        assert refused.status_code == 422
        assert [(one["pointer"], one["code"]) for one in refused.json()["errors"]] == [
            (place, "unknown_asset")
        ]
        # A quote takes seconds, and is refused by the same rule.
        for user in ("ann", "tutor") if path != "/v1/quotes" else ():
            assert world.ask(user, "POST", path, json={"scene": document}).status_code in {200, 202}


def test_rays_hit_no_meshes_of_others(world: World) -> None:
    body = {"scene": with_mesh(FILES["ply binary"]()), "origins": [[0, 0, 9]], "directions": [[0, 0, -1]]}
    assert world.ask("bob", "POST", "/v1/traces", json=body).status_code == 422
    assert world.ask("ann", "POST", "/v1/traces", json=body).status_code == 200


def test_staff_sees_the_files_of_all(world: World) -> None:
    path = f"/v1/assets/{world.things['sha256']}"
    assert world.ask("tutor", "GET", path).content == world.ask("ann", "GET", path).content == png(9, 9)


def test_sending_a_file_reveals_no_other_user_who_has_sent_it(world: World) -> None:
    known, new = png(9, 9), png(9, 10)
    answers = [upload(world, "bob", content) for content in (known, new)]
    assert [answer.status_code for answer in answers] == [200, 200]
    differing = [{"name", "bytes", "height"}, {"content-length", "x-request-id", "date"}]
    first, second = (
        {key: value for key, value in answer.json().items() if key not in differing[0]} for answer in answers
    )
    assert first == second
    assert set(answers[0].headers) == set(answers[1].headers)
    # Now both own it.
    assert world.ask("bob", "GET", f"/v1/assets/{world.things['sha256']}").content == known
    # Without the bytes a hash gives no access.
    wrong = world.ask("bob", "PUT", f"/v1/assets/{world.mesh.removeprefix('sha256:')}", content=new)
    unknown = world.ask("bob", "PUT", f"/v1/assets/{'1' * 64}", content=new)
    assert (wrong.status_code, wrong.text) == (unknown.status_code, unknown.text)
    assert wrong.status_code == 422


def test_the_files_of_a_user_have_a_limit_together(world: World) -> None:
    big = png(120, 120)
    assert 40_000 < len(big) < 50_000
    assert upload(world, "eve", big).status_code == 200
    refused = upload(world, "eve", png(119, 120))
    assert (refused.status_code, refused.json()["code"]) == (413, "upload_quota")
    assert str(60_000 - len(big)) in refused.json()["detail"]
    # A file that is there takes no more room, and every user has a quota.
    assert upload(world, "eve", big).status_code == 200
    assert upload(world, "bob", big).status_code == 200


def test_a_list_of_jobs_names_those_of_its_user(world: World) -> None:
    assert world.things["job_id"] in world.ask("ann", "GET", "/v1/jobs").text
    assert world.ask("bob", "GET", "/v1/jobs", params={"limit": 100}).text.count(world.things["job_id"]) == 0


@pytest.mark.parametrize(("method", "path"), routes())
def test_every_route_limits_what_browsers_may_do(world: World, method: str, path: str) -> None:
    things = world.things if method != "DELETE" else MISSING
    address = filled(path.replace(":path", ""), {"a": "x", "b": "y", "path": "main.js"} | things)
    for user in (None, "ann", "bob"):
        headers = world.ask(user, method, address).headers
        assert headers["X-Content-Type-Options"] == "nosniff"
        assert "frame-ancestors 'none'" in headers["Content-Security-Policy"]
        assert headers["Cross-Origin-Resource-Policy"] == "same-origin"
        if path not in PUBLIC:
            assert headers["Cache-Control"] == "no-store" or headers["Cache-Control"].startswith("private, ")
