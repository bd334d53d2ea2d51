"""Keys, sessions and roles."""

from __future__ import annotations

import subprocess
import sys
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import httpx2
import pytest
from sqlalchemy import select

from schemas.api.administration import Role
from service.access import keys
from service.cli.process import outcome
from service.settings import Settings
from service.storage.database.connection import Database
from service.storage.database.models import KeyRow, SessionRow
from tests.service.in_process import InProcess, in_process
from tests.service.sending import SMALL, bearer, make_keys, problem_of
from tests.service.support import TIMEOUT, until

EVERYWHERE = "0.0.0.0"  # noqa: S104  (it is refused)
ROLES = {"ann": Role.SUBMIT, "bob": Role.SUBMIT, "staff": Role.STAFF, "admin": Role.ADMIN}
Ask = Callable[..., httpx2.Response]


@pytest.fixture(scope="module")
def data(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return tmp_path_factory.mktemp("keys")


@pytest.fixture(scope="module")
def secrets(data: Path) -> dict[str, str]:
    return make_keys(data, **ROLES)


@pytest.fixture(scope="module")
def guarded(data: Path, secrets: dict[str, str]) -> Iterator[InProcess]:
    with in_process(Settings(data=data, workers=1)) as local:
        yield local


@pytest.fixture
def ask(guarded: InProcess, secrets: dict[str, str]) -> Ask:
    """Ask as one of the users."""

    def as_user(user: str, method: str, path: str, **request: Any) -> httpx2.Response:
        headers = bearer(secrets[user]) | request.pop("headers", {})
        with guarded.client(headers=headers) as client:
            return client.request(method, path, **request)

    return as_user


def submitted(ask: Ask, user: str, **headers: str) -> str:
    answer = ask(user, "POST", "/v1/jobs", json=SMALL, headers=headers)
    assert answer.status_code == 202, answer.text
    assert answer.json()["user"] == user
    return answer.json()["id"]


def test_key_that_is_not_good_opens_nothing(guarded: InProcess, secrets: dict[str, str]) -> None:
    changed = secrets["ann"][:-1] + ("A" if secrets["ann"][-1] != "A" else "B")
    unknown = f"pnm_{'0' * 12}_{'x' * 43}"
    with guarded.client() as client:
        for header in (None, "Bearer", "Bearer x", "Basic YTpi", f"Bearer {unknown}", f"Bearer {changed}"):
            headers = {"Authorization": header} if header else {}
            answer = client.get("/v1/jobs", headers=headers)
            assert problem_of(answer, 401)["code"] == "unauthenticated"
            assert answer.headers["WWW-Authenticate"] == "Bearer"


def test_key_is_not_in_the_database(guarded: InProcess, secrets: dict[str, str]) -> None:
    with guarded.service.database.reading() as session:
        kept = [row.secret_sha256 for row in session.scalars(select(KeyRow))]
    for secret in secrets.values():
        assert not any(secret.rpartition("_")[2] in row for row in kept)


def test_roles_say_who_sees_and_who_removes_a_job(ask: Ask) -> None:
    job = submitted(ask, "ann")
    for user in ("staff", "admin"):
        assert ask(user, "GET", f"/v1/jobs/{job}").json()["user"] == "ann"
    assert ask("bob", "DELETE", f"/v1/jobs/{job}").status_code == 404
    assert ask("staff", "DELETE", f"/v1/jobs/{job}").status_code == 403
    assert ask("staff", "POST", f"/v1/jobs/{job}/cancel").status_code == 403
    assert ask("admin", "DELETE", f"/v1/jobs/{job}").status_code == 204
    assert ask("ann", "GET", f"/v1/jobs/{job}").status_code == 404


def test_idempotency_keys_are_each_users_own(ask: Ask) -> None:
    jobs = [submitted(ask, user, **{"Idempotency-Key": "mine"}) for user in ("ann", "bob", "ann")]
    assert jobs[0] == jobs[2] != jobs[1]


def test_revoked_key_is_refused_and_its_session_ends(guarded: InProcess) -> None:
    database = guarded.service.database
    with database.writing() as session:
        key = keys.add(session, "eve", Role.SUBMIT)
    with guarded.client(headers=bearer(str(key))) as owner:
        begun = owner.post("/v1/session")
        assert begun.status_code == 200
        with database.writing() as session:
            assert keys.revoke(session, key.id)
        until(lambda: owner.get("/v1/session").status_code == 401)
    with guarded.client(cookies=begun.cookies) as browser:
        until(lambda: browser.get("/v1/session").status_code == 401)


def test_session_cookie_stands_for_a_key(guarded: InProcess, ask: Ask) -> None:
    begun = ask("ann", "POST", "/v1/session")
    assert begun.json() == {"user": "ann", "role": "submit", "keys_required": True}
    cookie = begun.headers["Set-Cookie"]
    assert "HttpOnly" in cookie
    assert "SameSite=strict" in cookie
    with guarded.service.database.reading() as session:
        assert begun.cookies["penumbra_session"] not in session.scalars(select(SessionRow.token_sha256)).all()
    with guarded.client(cookies=begun.cookies) as browser:
        assert browser.get("/v1/session").json()["user"] == "ann"
        assert browser.post("/v1/jobs", json=SMALL).json()["user"] == "ann"
        assert browser.delete("/v1/session").status_code == 204
    with guarded.client(cookies=begun.cookies) as browser:
        assert browser.get("/v1/session").status_code == 401


def test_cookie_is_refused_from_pages_of_other_sites(guarded: InProcess, ask: Ask) -> None:
    begun = ask("ann", "POST", "/v1/session")
    foreign = [{"Origin": "http://evil.example"}, {"Sec-Fetch-Site": "cross-site"}, {"Origin": "null"}]
    with guarded.client(cookies=begun.cookies) as browser:
        for headers in foreign:
            answer = browser.post("/v1/jobs", json=SMALL, headers=headers)
            assert problem_of(answer, 403)["code"] == "cross_site"
        own = {"Origin": "http://127.0.0.1", "Sec-Fetch-Site": "same-origin"}
        assert browser.post("/v1/jobs", json=SMALL, headers=own).status_code == 202


def test_pages_of_other_sites_change_nothing_without_keys(api: httpx2.Client) -> None:
    assert api.post("/v1/jobs", json=SMALL, headers={"Origin": "http://evil.example"}).status_code == 403
    assert api.get("/v1/session").json() == {"user": "local", "role": "admin", "keys_required": False}


@pytest.mark.slow
def test_service_for_others_does_not_start_without_keys(tmp_path: Path) -> None:
    command = [sys.executable, "-m", "service.cli.main", "serve", "--host", EVERYWHERE, "--port", "0"]
    refused = subprocess.run(
        [*command, "--data", str(tmp_path)], capture_output=True, text=True, timeout=TIMEOUT, check=False
    )
    assert refused.returncode == 4
    assert "penumbra keys add" in refused.stderr


def test_keys_are_made_listed_and_revoked(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    def penumbra(*words: str) -> tuple[int, str]:
        code = outcome(["keys", *words, "--data", str(tmp_path)])
        return code, capsys.readouterr().out

    code, made = penumbra("add", "ann", "--role", "staff", "--max-jobs", "7")
    key = made.strip()
    name = key.split("_")[1]
    _, listed = penumbra("ls")
    assert (code, listed.startswith(f"{name}\tann\tstaff\t7\t"), key in listed) == (0, True, False)
    assert [penumbra("revoke", each)[0] for each in (name, "missing")] == [0, 2]
    opened = Database(Settings(data=tmp_path).database_url)
    with opened.reading() as session:
        assert keys.principal_of_key(session, key) is None
        # The last key is gone, and authentication stays on.
        assert keys.any_made(session)
    opened.close()
