"""Keys, sessions and roles."""

import csv
import subprocess
import sys
from collections.abc import Callable, Iterator
from concurrent.futures import ThreadPoolExecutor
from datetime import UTC, datetime, timedelta
from pathlib import Path
from typing import Any

import httpx2
import pytest
from sqlalchemy import select

from schemas.api.administration import KeyRequest, Role
from service.access import keys
from service.access.roster import enrol
from service.cli.process import outcome
from service.settings import Settings
from service.storage.database.connection import Database
from service.storage.database.models import KeyRow, SessionRow
from tests.service.in_process import InProcess, in_process
from tests.service.sending import SMALL, bearer, make_keys, mistakes, problem_of
from tests.service.support import BOTH, TIMEOUT, long_scene, until

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
    with in_process(Settings(data=data, workers=1, heartbeat_seconds=0.2)) as local:
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
        # Its last part may have underscores of its own.
        assert not any(secret.split("_", 2)[2] in row for row in kept)


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


def test_admin_creates_lists_and_revokes_keys_over_http(guarded: InProcess, ask: Ask) -> None:
    calls = ("GET", "/v1/keys"), ("POST", "/v1/keys"), ("DELETE", "/v1/keys/x"), ("POST", "/v1/rosters")
    for method, path in calls:
        assert problem_of(ask("staff", method, path), 403)["code"] == "forbidden"
    made = ask("admin", "POST", "/v1/keys", json={"user": "zoe", "max_jobs": 7, "expires_at": "2999-01-31"})
    key = made.json()["key"]
    assert (made.status_code, made.json()["expires_at"]) == (201, "2999-01-31T00:00:00Z")

    def listed() -> dict[str, Any]:
        pages, cursor = [], {}
        while not pages or cursor["cursor"]:
            page = ask("admin", "GET", "/v1/keys", params={"limit": 2} | cursor)
            assert key not in page.text
            pages += page.json()["keys"]
            cursor = {"cursor": page.json()["next"]}
        return {one["user"]: one for one in pages}

    with guarded.client(headers=bearer(key)) as zoe:
        assert zoe.get("/v1/session").json()["user"] == "zoe"
        assert [listed()[user]["last_used_at"] for user in ("zoe", "staff")] == [None, None]
        guarded.service.credentials.write_uses()
        assert listed()["zoe"]["last_used_at"] >= listed()["zoe"]["created_at"]
        assert ask("admin", "DELETE", f"/v1/keys/{made.json()['id']}").status_code == 204
        assert zoe.get("/v1/session").status_code == 401
    assert listed()["zoe"]["revoked_at"]
    assert problem_of(ask("admin", "DELETE", "/v1/keys/missing"), 404)["code"] == "unknown_key"


def test_expired_key_and_its_session_are_refused_with_the_date(guarded: InProcess, ask: Ask) -> None:
    end = datetime.now(UTC) + timedelta(seconds=1)
    key = ask("admin", "POST", "/v1/keys", json={"user": "max", "expires_at": end.isoformat()}).json()["key"]
    with guarded.client(headers=bearer(key)) as owner, guarded.client() as browser:
        browser.cookies = owner.post("/v1/session").cookies
        for client in (owner, browser):
            until(lambda client=client: client.get("/v1/session").status_code == 401)
            found = problem_of(client.get("/v1/session"), 401)
            assert found["code"] == "key_expired"
            assert f"{end:%Y-%m-%d}" in found["detail"]
    past = ask("admin", "POST", "/v1/keys", json={"user": "max", "expires_at": "2001-01-31"})
    assert mistakes(past) == [("/expires_at", "out_of_range")]


def test_roster_makes_one_key_a_user_however_often_it_is_sent(guarded: InProcess, ask: Ask) -> None:
    text = 'user,role,max_jobs\r\nkim,,3\r\n"lee, jr",staff,\r\nann,,\r\n'
    answers = [ask("admin", "POST", "/v1/rosters", content=text.encode("utf-8-sig")) for _ in range(2)]
    first, second = ([*csv.DictReader(answer.text.splitlines())] for answer in answers)
    assert [row["user"] for row in first if row["key"]] == ["kim", "lee, jr"]
    assert [row["key"] for row in second] == ["", "", ""]
    assert [row["id"] for row in first] == [row["id"] for row in second]
    with guarded.client(headers=bearer(first[1]["key"])) as lee:
        assert lee.get("/v1/session").json()["role"] == "staff"
    wrong = b"user,role,max_jobs\nkim,boss,x\n\nkim,,\nkim,,1,2\n"
    found = problem_of(ask("admin", "POST", "/v1/rosters", content=wrong), 422)["errors"]
    assert [problem["line"] for problem in found] == [2, 2, 5]
    for text in (
        "",
        "user" + 5001 * "\nkim",
        "name\n",
        "user,rol\n",
        'user\n"',
        "user\nj\xf6".encode("latin-1"),
    ):
        problem_of(ask("admin", "POST", "/v1/rosters", content=text), 422)


@BOTH
def test_revoked_and_expired_keys_are_replaced_by_a_roster(database: Database) -> None:
    roster = [KeyRequest(user=user) for user in ("ann", "bob", "eve")]
    with database.writing() as session:
        assert keys.revoke(session, keys.add(session, "ann", Role.SUBMIT).id)
        keys.add(session, "bob", Role.SUBMIT, expires_at=datetime.now(UTC))
        keys.add(session, "eve", Role.SUBMIT, expires_at=datetime.now(UTC) + timedelta(days=1))
        assert [bool(row.key) for row in enrol(session, roster)] == [True, True, False]
        assert not any(row.key for row in enrol(session, roster))
        pages = [keys.page(session, 2, None)]
        while pages[-1]:
            pages.append(keys.page(session, 2, pages[-1][-1].id))
    assert [row.user for page in pages for row in page] == ["ann", "ann", "bob", "bob", "eve"]


def test_stream_ends_with_its_key(guarded: InProcess, ask: Ask) -> None:
    with guarded.service.database.writing() as session:
        key = keys.add(session, "eve", Role.SUBMIT)
    with guarded.client(headers=bearer(str(key))) as eve, ThreadPoolExecutor(1) as pool:
        job = eve.post("/v1/jobs", json={"scene": long_scene()}).json()["id"]
        assert eve.post(f"/v1/jobs/{job}/pause").json()["paused"]
        stream = pool.submit(eve.get, f"/v1/jobs/{job}/events")
        try:
            # Now it waits.
            until(lambda: guarded.service.job_events.pause(job) >= 0)
            with guarded.service.database.writing() as session:
                keys.revoke(session, key.id)
            answer = stream.result(TIMEOUT)
        finally:
            ask("admin", "POST", f"/v1/jobs/{job}/cancel")
    assert answer.status_code == 200
    assert "event: end" not in answer.text


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
    assert "keys add" in problem_of(api.post("/v1/keys", json={"user": "ann"}), 403)["detail"]
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
    assert penumbra("add", "ann", "--expires", "2001-01-31")[0] == 2
    (tmp_path / "class.csv").write_text("user\nann\nbob\n")
    enrolled = [penumbra("roster", str(tmp_path / "class.csv"))[1].count("pnm_") for _ in range(2)]
    assert enrolled == [1, 0]
    _, listed = penumbra("ls")
    assert (code, listed.startswith(f"{name}\tann\tstaff\t7\t"), key in listed) == (0, True, False)
    assert [penumbra("revoke", each)[0] for each in (name, "missing")] == [0, 2]
    opened = Database(Settings(data=tmp_path).database_url)
    with opened.reading() as session:
        assert keys.principal_of_key(session, key) is None
        # The last key is gone, and authentication stays on.
        assert keys.any_made(session)
    opened.close()
