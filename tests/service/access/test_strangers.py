"""Access control of every route; the list of routes is that of the application."""

import re
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from typing import Any

import httpx2
import pytest
from fastapi.routing import iter_route_contexts

from schemas.api.administration import Role
from service.app import create_app
from service.settings import Settings
from tests.service.in_process import InProcess, in_process
from tests.service.sending import (
    bearer,
    make_keys,
    mistakes,
    name_of,
    ply,
    png,
    problem_of,
    put,
    textured,
    with_mesh,
)

# Public: it shows nothing of any user.
PUBLIC = {
    "/livez",
    "/readyz",
    "/version",
    "/openapi.json",
    "/",
    "/jobs",
    "/jobs/{job_id}",
    "/service",
    "/compare",
    "/compare/{a}/{b}",
    "/web/{path:path}",
    "/gallery/{path:path}",
    "/docs",
}
# Ids in an address: on every route those of another user must not be found.
THINGS = {"job_id", "sha256"}
MISSING = {"job_id": "0123456789abcdef", "sha256": "0" * 64}
"""Names that nothing has."""
PICTURE, MESH = png(9, 9), ply()


def routes() -> list[tuple[str, str]]:
    """Every method with every address that the application answers."""
    contexts = iter_route_contexts(create_app(Settings()).routes)
    return sorted((method, str(route.path)) for route in contexts for method in route.methods or ())


ROUTES = routes()
PRIVATE = [(method, path) for method, path in ROUTES if path not in PUBLIC]
OWNED = [(method, path) for method, path in PRIVATE if THINGS & set(re.findall(r"{(\w+)", path))]


@dataclass
class World:
    """A service with keys, and what ann has there."""

    local: InProcess
    secrets: dict[str, str]
    things: dict[str, str]

    def client(self, user: str | None) -> httpx2.Client:
        return self.local.client(headers=bearer(self.secrets[user]) if user else {})

    def ask(self, user: str | None, method: str, path: str, **request: Any) -> httpx2.Response:
        with self.client(user) as client:
            return client.request(method, path, **request)


@pytest.fixture(scope="module")
def world(tmp_path_factory: pytest.TempPathFactory) -> Iterator[World]:
    data = tmp_path_factory.mktemp("strangers")
    secrets = make_keys(
        data, ann=Role.SUBMIT, bob=Role.SUBMIT, eve=Role.SUBMIT, tutor=Role.STAFF, fay=Role.SUBMIT
    )
    settings = Settings(data=data, workers=1, max_user_asset_bytes=60_000, max_asset_bytes=50_000)
    with in_process(settings) as local:
        there = World(local, secrets, {})
        with there.client("ann") as ann:
            for content in (PICTURE, MESH):
                put(ann, content).raise_for_status()
            sent = {"scene": textured(name_of(PICTURE))}
            answer = ann.post("/v1/jobs", json=sent, headers={"Prefer": "wait=30"})
        assert answer.json().get("state") == "succeeded", answer.text
        there.things = {"job_id": answer.json()["id"], "sha256": name_of(PICTURE).removeprefix("sha256:")}
        yield there


def filled(path: str, things: dict[str, str]) -> str:
    return path.replace(":path", "").format(
        **{"name": "depth", "a": "x", "b": "y", "path": "main.js", "key_id": "none"} | things
    )


def test_every_private_route_asks_for_a_key(world: World) -> None:
    for method, path in PRIVATE:
        answer = world.ask(None, method, filled(path, world.things), content=b"{}")
        assert (answer.status_code, answer.headers["WWW-Authenticate"]) == (401, "Bearer"), (method, path)


def test_every_thing_of_another_user_looks_like_a_missing_one(world: World) -> None:
    for method, path in OWNED:
        if method == "PUT":
            continue
        body: dict[str, Any] = {} if method in {"GET", "HEAD", "DELETE"} else {"json": {"x": 0, "y": 0}}
        foreign = world.ask("bob", method, filled(path, world.things), **body)
        missing = world.ask("bob", method, filled(path, MISSING), **body)
        assert foreign.status_code == 404, (method, path)
        assert (foreign.status_code, foreign.text) == (missing.status_code, missing.text), (method, path)
        assert set(foreign.headers) == set(missing.headers), (method, path)
        # The address was right: the job is there for its owner, who has not requested this layer.
        if method != "DELETE":
            allowed = world.ask("ann", method, filled(path, world.things), **body)
            assert allowed.status_code != 404 or path.endswith("/layers/{name}.npy"), (method, path)


@pytest.mark.slow
def test_every_answer_limits_what_browsers_and_caches_do(world: World) -> None:
    for method, path in [*ROUTES, ("GET", "/none")]:
        address = filled(path, world.things if method != "DELETE" else MISSING)
        for user in (None, "ann", "bob"):
            headers = world.ask(user, method, address).headers
            policy = headers["Content-Security-Policy"]
            assert "default-src 'none'" in policy
            assert "frame-ancestors 'none'" in policy
            assert "script-src" not in policy or "script-src 'self';" in policy
            assert headers["X-Content-Type-Options"] == "nosniff"
            assert headers["Referrer-Policy"] == "no-referrer"
            assert headers["Cross-Origin-Resource-Policy"] == "same-origin"
            assert "Access-Control-Allow-Origin" not in headers
            if (method, path) in PRIVATE:
                rule = headers["Cache-Control"]
                assert rule == "no-store" or rule.startswith("private, "), (method, path)


@pytest.mark.parametrize("path", ["/v1/jobs", "/v1/plans", "/v1/quotes"])
def test_scene_names_no_files_of_others(world: World, path: str) -> None:
    for document, place in (
        (textured(name_of(PICTURE)), "/scene/textures/a~1b/asset"),
        (with_mesh(MESH), "/scene/shapes/1/asset"),
    ):
        refused = world.ask("bob", "POST", path, json={"scene": document})
        assert mistakes(refused) == [(place, "unknown_asset")]
        # A quote takes seconds, and is refused by the same rule.
        for user in ("ann", "tutor") if path != "/v1/quotes" else ():
            assert world.ask(user, "POST", path, json={"scene": document}).status_code in {200, 202}


def test_rays_hit_no_meshes_of_others(world: World) -> None:
    body = {"scene": with_mesh(MESH), "origins": [[0, 0, 9]], "directions": [[0, 0, -1]]}
    assert world.ask("bob", "POST", "/v1/traces", json=body).status_code == 422
    assert world.ask("ann", "POST", "/v1/traces", json=body).status_code == 200


def test_jobs_of_others_are_in_no_list(world: World) -> None:
    assert world.things["job_id"] in world.ask("ann", "GET", "/v1/jobs").text
    assert world.things["job_id"] in world.ask("tutor", "GET", "/v1/jobs").text
    assert world.things["job_id"] not in world.ask("bob", "GET", "/v1/jobs", params={"limit": 100}).text


def test_upload_reveals_no_other_user_who_has_sent_the_file(world: World) -> None:
    new = png(9, 10)
    path = f"/v1/assets/{world.things['sha256']}"
    assert world.ask("tutor", "GET", path).content == PICTURE
    with world.client("bob") as bob:
        first, second = put(bob, PICTURE), put(bob, new)
        assert [first.status_code, second.status_code] == [200, 200]
        same = [{**answer.json(), "name": 0, "bytes": 0, "height": 0} for answer in (first, second)]
        assert same[0] == same[1]
        assert set(first.headers) == set(second.headers)
        # Now both own it.
        assert bob.get(path).content == PICTURE
        # Without the bytes a hash gives no access.
        wrong, unknown = (
            put(bob, new, sha256) for sha256 in (name_of(MESH).removeprefix("sha256:"), "1" * 64)
        )
        assert problem_of(wrong, 422) == problem_of(unknown, 422)


def test_uploads_of_a_user_have_a_limit_together(world: World) -> None:
    big = png(120, 120)
    assert 40_000 < len(big) < 50_000
    with world.client("eve") as eve:
        assert put(eve, big).status_code == 200
        assert problem_of(put(eve, png(119, 120)), 413)["code"] == "upload_quota"
        # A file that is there takes no more room.
        assert put(eve, big).status_code == 200
    with world.client("bob") as bob:
        assert put(bob, big).status_code == 200


def test_uploads_at_the_same_time_have_the_same_limit(world: World) -> None:
    files = [png(120 + number, 120) for number in range(6)]
    with world.client("fay") as fay, ThreadPoolExecutor(6) as pool:
        codes = sorted(answer.status_code for answer in pool.map(lambda file: put(fay, file), files))
        assert codes == [200] + 5 * [413]
        assert sum(fay.head(f"/v1/assets/{name_of(file)[7:]}").status_code == 200 for file in files) == 1


def test_metrics_and_pruning_have_their_roles(world: World) -> None:
    for user, expected in {"ann": (403, 403), "tutor": (200, 403)}.items():
        asked = world.ask(user, "GET", "/metrics"), world.ask(user, "POST", "/v1/prune", json={})
        assert tuple(answer.status_code for answer in asked) == expected
