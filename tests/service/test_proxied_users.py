"""Who comes by a proxy, and what they may do: no one is an admin unless a setting says so."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import httpx2
import pytest
from pydantic import ValidationError

from schemas.api.administration import Role
from service.server import RunningServer, running
from service.settings import Settings
from tests.service.support import TIMEOUT, finish, scene, submit
from tests.service.test_access import penumbra
from tests.service.test_proxy import make_key

HEADER = "X-Forwarded-User"
HOSTS = "127.0.0.1"
Change = dict[str, str]


@pytest.mark.parametrize(
    ("settings", "cure"),
    [
        ({}, "PENUMBRA_HOSTS"),
        ({"PENUMBRA_PROXY_ROLE": "admin"}, "PENUMBRA_HOSTS"),
        ({"PENUMBRA_HOSTS": HOSTS}, "PENUMBRA_PROXY_USER_HEADER"),
        ({"PENUMBRA_HOSTS": HOSTS, "PENUMBRA_PROXY_ROLE": "root"}, "PENUMBRA_PROXY_ROLE: "),
    ],
)
def test_a_service_behind_a_proxy_starts_only_if_it_knows_its_names_and_its_users(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, settings: Change, cure: str
) -> None:
    for name, value in settings.items():
        monkeypatch.setenv(name, value)
    refused = penumbra("serve", "--behind-proxy", "--port", "0", "--data", tmp_path)
    assert refused.returncode == 2
    assert cure in " ".join(refused.stderr.split())


def test_what_proxies_are_told_without_one_is_refused(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("PENUMBRA_PROXY_USER_HEADER", HEADER)
    refused = penumbra("serve", "--port", "0", "--data", tmp_path)
    assert (refused.returncode, "behind_proxy" in refused.stderr) == (2, True)


def test_a_trusted_proxy_is_an_address_or_a_network() -> None:
    assert Settings(trusted_proxies="10.0.0.5 ::1 10.1.0.0/16").trusted_proxies
    for wrong in ("proxy.example", "10.0.0.5,10.0.0.6", "10.1.2.3/16"):
        with pytest.raises(ValidationError, match="write addresses such as"):
            Settings(trusted_proxies=wrong)


def test_a_link_of_kubernetes_in_place_of_a_port_is_explained(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("PENUMBRA_PORT", "tcp://10.96.0.17:8000")
    refused = penumbra("serve", "--data", tmp_path)
    said = " ".join(refused.stderr.split())
    assert refused.returncode == 2
    assert "PENUMBRA_PORT: Kubernetes sets this" in said
    assert "enableServiceLinks: false" in said


@pytest.fixture(scope="module")
def named(tmp_path_factory: pytest.TempPathFactory) -> Iterator[RunningServer]:
    """Behind a proxy that names the users."""
    settings = Settings(
        data=tmp_path_factory.mktemp("named"),
        port=0,
        workers=1,
        log_level="error",
        behind_proxy=True,
        hosts=HOSTS,
        proxy_user_header=HEADER,
    )
    with running(settings) as server:
        yield server


def client_of(server: RunningServer, *users: str) -> httpx2.Client:
    headers = [(HEADER, user) for user in users]
    return httpx2.Client(base_url=server.url, timeout=TIMEOUT, headers=headers)


def test_a_user_of_the_header_owns_jobs_that_others_do_not_see(named: RunningServer) -> None:
    with client_of(named, "ada") as ada, client_of(named, "bob") as bob:
        job = finish(ada, submit(ada, scene(8, 8)))
        assert job["user"] == "ada"
        assert ada.get("/v1/session").json() == {"user": "ada", "role": "submit", "keys_required": False}
        assert bob.get(f"/v1/jobs/{job['id']}").status_code == 404
        assert bob.get("/metrics").status_code == 403
        assert [found["id"] for found in ada.get("/v1/jobs").json()["jobs"]] == [job["id"]]


@pytest.mark.parametrize("users", [(), ("",), ("a" * 65,), ("ada", "root"), ("a\tb",)])
def test_without_one_name_of_a_user_nothing_is_answered(named: RunningServer, users: tuple[str, ...]) -> None:
    with client_of(named, *users) as client:
        answer = client.get("/v1/jobs")
        assert (answer.status_code, HEADER in answer.json()["detail"]) == (403, True)
        assert client.get("/readyz").status_code == 200


@pytest.mark.slow
@pytest.mark.parametrize("role", Role)
def test_all_have_the_role_that_the_setting_gives_them(tmp_path: Path, role: Role) -> None:
    settings = Settings(
        data=tmp_path, port=0, workers=1, log_level="error", behind_proxy=True, hosts=HOSTS, proxy_role=role
    )
    with running(settings) as server, client_of(server) as client:
        assert client.get("/v1/session").json()["role"] == role
        assert client.get("/metrics").status_code == (403 if role is Role.SUBMIT else 200)
        assert client.post("/v1/prune", json={}).status_code == (200 if role is Role.ADMIN else 403)
        rebound = client.get("/v1/jobs", headers={"Host": "rebound.example"})
        assert (rebound.status_code, rebound.json()["code"]) == (421, "unknown_host")


PROXY = "127.0.0.2"
"""An address of this machine that is not the one of which proxies are believed by default."""


@pytest.mark.slow
@pytest.mark.parametrize("trusted", [None, f"10.0.0.0/8 {PROXY}"])
def test_a_proxy_that_is_not_on_loopback_is_believed_where_a_setting_names_it(
    tmp_path: Path, trusted: str | None
) -> None:
    key = make_key(tmp_path)
    headers = {"X-Forwarded-Proto": "https", "Authorization": f"Bearer {key}"}
    settings = Settings(data=tmp_path, port=0, workers=1, log_level="error", trusted_proxies=trusted)
    transport = httpx2.HTTPTransport(local_address=PROXY)
    with (
        running(settings) as server,
        httpx2.Client(base_url=server.url, transport=transport, timeout=TIMEOUT) as client,
    ):
        cookie = client.post("/v1/session", headers=headers).headers["Set-Cookie"]
        name, _, token = cookie.partition(";")[0].partition("=")
        expected = "__Host-penumbra_session" if trusted else "penumbra_session"
        assert (name, "; Secure" in cookie, "; Path=/" in cookie) == (expected, trusted is not None, True)
        assert "domain" not in cookie.lower()
        sent = {"X-Forwarded-Proto": "https", "Cookie": f"{name}={token}"}
        assert client.get("/v1/session", headers=sent).json()["user"] == "ada"
        if trusted:
            # Another host of the domain can set a cookie of this name, but none with the prefix.
            forged = sent | {"Cookie": f"penumbra_session={token}"}
            assert client.get("/v1/session", headers=forged).status_code == 401
