"""Keys, sessions and roles, over HTTP with a real service that requires keys."""

from __future__ import annotations

import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import httpx2
import pytest
from sqlalchemy import select

from schemas.api.administration import Role
from service.access import keys
from service.server import RunningServer, running
from service.settings import Settings
from service.storage.database.connection import Database
from service.storage.database.migrations import upgrade
from service.storage.database.models import KeyRow, SessionRow
from tests.service.support import TIMEOUT, scene, until

EVERYWHERE = "0.0.0.0"  # noqa: S104  (it is refused)
SMALL = {"scene": scene(16, 16, samples=1, light_samples=1)}


@pytest.fixture(scope="module")
def data(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return tmp_path_factory.mktemp("keys")


@pytest.fixture(scope="module")
def database(data: Path) -> Iterator[Database]:
    opened = Database(Settings(data=data).database_url)
    upgrade(opened)
    yield opened
    opened.close()


@pytest.fixture(scope="module")
def secrets(database: Database) -> dict[str, str]:
    """A key each for two students, a member of staff and an admin."""
    roles = {"ann": Role.SUBMIT, "bob": Role.SUBMIT, "staff": Role.STAFF, "admin": Role.ADMIN}
    with database.writing() as session:
        return {user: str(keys.add(session, user, role)) for user, role in roles.items()}


@pytest.fixture(scope="module")
def guarded(data: Path, secrets: dict[str, str]) -> Iterator[RunningServer]:
    with running(Settings(data=data, port=0, workers=1, log_level="error")) as server:
        yield server


class Users:
    """Clients of a service, one for each user."""

    def __init__(self, url: str, secrets: dict[str, str]) -> None:
        self.url, self._secrets = url, secrets

    def __call__(self, user: str, method: str, path: str, **request: Any) -> httpx2.Response:
        headers = {"Authorization": f"Bearer {self._secrets[user]}"} | request.pop("headers", {})
        return httpx2.request(method, self.url + path, headers=headers, timeout=TIMEOUT, **request)

    def submit(self, user: str, **headers: str) -> dict[str, Any]:
        answer = self(user, "POST", "/v1/jobs", json=SMALL, headers={"Prefer": "wait=30"} | headers)
        assert answer.status_code == 202, answer.text
        return answer.json()


@pytest.fixture
def users(guarded: RunningServer, secrets: dict[str, str]) -> Users:
    return Users(guarded.url, secrets)


@pytest.mark.parametrize(
    "header",
    [None, "Bearer", "Bearer x", "Basic YTpi", f"Bearer pnm_{'0' * 12}_{'x' * 43}"],
    ids=["none", "empty", "no key", "another scheme", "unknown"],
)
def test_without_a_good_key_nothing_is_answered(guarded: RunningServer, header: str | None) -> None:
    for method, path in (("GET", "/v1/jobs"), ("POST", "/v1/jobs"), ("GET", "/v1/session")):
        headers = {"Authorization": header} if header else {}
        answer = httpx2.request(method, guarded.url + path, headers=headers)
        assert (answer.status_code, answer.json()["code"]) == (401, "unauthenticated")
        assert answer.headers["WWW-Authenticate"] == "Bearer"


def test_a_key_with_another_secret_is_not_good(guarded: RunningServer, secrets: dict[str, str]) -> None:
    changed = secrets["ann"][:-1] + ("A" if secrets["ann"][-1] != "A" else "B")
    answer = httpx2.get(f"{guarded.url}/v1/jobs", headers={"Authorization": f"Bearer {changed}"})
    assert answer.status_code == 401


def test_operations_ask_for_no_key(guarded: RunningServer) -> None:
    for path in ("/livez", "/readyz", "/version"):
        assert httpx2.get(guarded.url + path).status_code == 200


def test_the_stored_part_of_a_key_does_not_reveal_it(database: Database, secrets: dict[str, str]) -> None:
    with database.reading() as session:
        kept = [row.secret_sha256 for row in session.scalars(select(KeyRow))]
    for secret in secrets.values():
        assert not any(secret.rpartition("_")[2] in row for row in kept)


def test_a_user_sees_their_own_jobs_and_no_others(users: Users) -> None:
    job = users.submit("ann")
    assert job["user"] == "ann"
    assert job["id"] in [row["id"] for row in users("ann", "GET", "/v1/jobs").json()["jobs"]]
    assert job["id"] not in [row["id"] for row in users("bob", "GET", "/v1/jobs").json()["jobs"]]
    for path in ("", "/tiles", "/events", "/image.png", "/plan", "/convergence", "/request"):
        assert users("ann", "GET", f"/v1/jobs/{job['id']}{path}").status_code == 200, path
        answer = users("bob", "GET", f"/v1/jobs/{job['id']}{path}")
        unknown = users("bob", "GET", f"/v1/jobs/0123456789abcdef{path}")
        assert (answer.status_code, answer.text) == (404, unknown.text), path
    pixel = users("bob", "POST", f"/v1/jobs/{job['id']}/inspections", json={"x": 0, "y": 0})
    assert pixel.status_code == 404


def test_a_user_compares_no_pictures_of_others(users: Users) -> None:
    job = users.submit("ann")["id"]
    both = {"image": {"job": job}, "reference": {"job": job}}
    assert users("ann", "POST", "/v1/comparisons", json=both).status_code == 200
    assert users("bob", "POST", "/v1/comparisons", json=both).status_code == 422


def test_staff_sees_all_and_an_admin_removes_all(users: Users) -> None:
    job = users.submit("ann")["id"]
    for user in ("staff", "admin"):
        assert users(user, "GET", f"/v1/jobs/{job}").json()["user"] == "ann"
        assert job in [row["id"] for row in users(user, "GET", "/v1/jobs").json()["jobs"]]
    assert users("bob", "DELETE", f"/v1/jobs/{job}").status_code == 404
    assert users("staff", "DELETE", f"/v1/jobs/{job}").status_code == 403
    assert users("staff", "POST", f"/v1/jobs/{job}/cancel").status_code == 403
    assert users("admin", "DELETE", f"/v1/jobs/{job}").status_code == 204
    assert users("ann", "GET", f"/v1/jobs/{job}").status_code == 404


def test_keys_of_requests_are_each_users_own(users: Users) -> None:
    jobs = [users.submit(user, **{"Idempotency-Key": "mine"})["id"] for user in ("ann", "bob", "ann")]
    assert jobs[0] == jobs[2] != jobs[1]


def test_a_revoked_key_is_refused_and_its_session_ends(users: Users, database: Database) -> None:
    with database.writing() as session:
        key = keys.add(session, "eve", Role.SUBMIT)
    headers = {"Authorization": f"Bearer {key}"}
    begun = httpx2.post(f"{users.url}/v1/session", headers=headers)
    assert begun.status_code == 200
    with database.writing() as session:
        assert keys.revoke(session, key.id)
    with httpx2.Client(base_url=users.url, headers=headers) as client:
        until(lambda: client.get("/v1/session").status_code == 401)
    with httpx2.Client(base_url=users.url, cookies=begun.cookies) as browser:
        until(lambda: browser.get("/v1/session").status_code == 401)


def test_a_cookie_stands_for_a_key_and_scripts_do_not_see_it(users: Users, database: Database) -> None:
    begun = users("ann", "POST", "/v1/session")
    assert begun.json() == {"user": "ann", "role": "submit", "keys_required": True}
    cookie = begun.headers["Set-Cookie"]
    assert "HttpOnly" in cookie
    assert "SameSite=strict" in cookie
    with httpx2.Client(base_url=users.url, cookies=begun.cookies) as browser:
        assert browser.get("/v1/session").json()["user"] == "ann"
        assert browser.post("/v1/jobs", json=SMALL).json()["user"] == "ann"
        assert browser.delete("/v1/session").status_code == 204
    with httpx2.Client(base_url=users.url, cookies=begun.cookies) as browser:
        assert browser.get("/v1/session").status_code == 401
    with database.reading() as session:
        assert begun.cookies["penumbra_session"] not in session.scalars(select(SessionRow.token_sha256)).all()


@pytest.mark.parametrize(
    "headers",
    [{"Origin": "http://evil.example"}, {"Sec-Fetch-Site": "cross-site"}, {"Origin": "null"}],
    ids=["origin", "fetch", "no origin"],
)
def test_pages_of_other_sites_change_nothing_with_the_cookie(users: Users, headers: dict[str, str]) -> None:
    begun = users("ann", "POST", "/v1/session")
    with httpx2.Client(base_url=users.url, cookies=begun.cookies) as browser:
        answer = browser.post("/v1/jobs", json=SMALL, headers=headers)
        assert (answer.status_code, answer.json()["code"]) == (403, "cross_site")
        own = {"Origin": users.url, "Sec-Fetch-Site": "same-origin"}
        assert browser.post("/v1/jobs", json=SMALL, headers=own).status_code == 202


def test_pages_of_other_sites_change_nothing_where_no_keys_are(client: httpx2.Client) -> None:
    answer = client.post("/v1/jobs", json=SMALL, headers={"Origin": "http://evil.example"})
    assert answer.status_code == 403
    assert client.get("/v1/session").json() == {"user": "local", "role": "admin", "keys_required": False}


def penumbra(*words: str | Path) -> subprocess.CompletedProcess[str]:
    command = [sys.executable, "-m", "service.cli.main", *map(str, words)]
    return subprocess.run(command, capture_output=True, text=True, timeout=TIMEOUT, check=False)


def test_the_command_line_says_where_it_takes_a_key_from(
    guarded: RunningServer, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.delenv("PENUMBRA_KEY", raising=False)
    for reason, key in {"This service requires a key.": None, "This key is not valid": "pnm_0_x"}.items():
        if key is not None:
            monkeypatch.setenv("PENUMBRA_KEY", key)
        refused = penumbra("ls", "--server", guarded.url)
        assert refused.returncode == 4
        assert reason in refused.stderr
        assert "from the variable PENUMBRA_KEY" in refused.stderr


def test_a_service_for_others_does_not_start_without_keys(tmp_path: Path) -> None:
    refused = penumbra("serve", "--host", EVERYWHERE, "--port", "0", "--data", tmp_path)
    assert refused.returncode == 4
    assert f"penumbra keys add NAME --data {tmp_path}" in refused.stderr
    assert "--behind-proxy" in refused.stderr


def test_keys_are_made_listed_and_revoked(tmp_path: Path) -> None:
    made = penumbra("keys", "add", "ann", "--role", "staff", "--max-jobs", "7", "--data", tmp_path)
    assert made.returncode == 0, made.stderr
    key = made.stdout.strip()
    listed = penumbra("keys", "ls", "--data", tmp_path).stdout
    name = key.split("_")[1]
    assert listed.startswith(f"{name}\tann\tstaff\t7\t")
    assert key not in listed
    assert penumbra("keys", "revoke", name, "--data", tmp_path).returncode == 0
    assert penumbra("keys", "revoke", "missing", "--data", tmp_path).returncode == 2
    opened = Database(Settings(data=tmp_path).database_url)
    with opened.reading() as session:
        assert keys.principal_of_key(session, key) is None
        # The last key is gone, and authentication stays on.
        assert keys.any_made(session)
    opened.close()
