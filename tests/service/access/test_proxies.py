"""Users behind a proxy and their rights: no one is an admin unless a setting says so."""

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
from pydantic import ValidationError

from schemas.api.administration import Role
from service.settings import Settings
from tests.service.forking import running
from tests.service.in_process import InProcess, in_process
from tests.service.sending import bearer, client_of, make_keys, problem_of
from tests.service.support import finish, scene, submit

HEADER = "X-Forwarded-User"
NAME = "render.example"
PROXY = "127.0.0.2"
"""An address of this machine that is not the one of which proxies are believed by default."""


@pytest.mark.parametrize(
    ("settings", "cure"),
    [
        ({"behind_proxy": True}, "hosts"),
        ({"behind_proxy": True, "proxy_role": "admin"}, "hosts"),
        ({"behind_proxy": True, "hosts": NAME}, "proxy_user_header"),
        ({"behind_proxy": True, "hosts": NAME, "proxy_role": "root"}, "proxy_role"),
        ({"proxy_user_header": HEADER}, "behind_proxy"),
        ({"trusted_proxies": "proxy.example"}, "trusted_proxies"),
        ({"trusted_proxies": "10.0.0.5,10.0.0.6"}, "trusted_proxies"),
        ({"trusted_proxies": "10.1.2.3/16"}, "trusted_proxies"),
        ({"port": "tcp://10.96.0.17:8000"}, "enableServiceLinks"),
    ],
)
def test_settings_of_a_proxy_are_checked(settings: dict[str, Any], cure: str) -> None:
    with pytest.raises(ValidationError) as caught:
        Settings(**settings)
    assert cure.lower() in str(caught.value).lower()
    assert Settings(trusted_proxies="10.0.0.5 ::1 10.1.0.0/16").trusted_proxies


@pytest.fixture(scope="module")
def named(tmp_path_factory: pytest.TempPathFactory) -> Iterator[InProcess]:
    """Behind a proxy that names the users."""
    data = tmp_path_factory.mktemp("named")
    with in_process(
        Settings(data=data, workers=1, behind_proxy=True, hosts="127.0.0.1", proxy_user_header=HEADER)
    ) as local:
        yield local


def test_user_of_the_header_owns_jobs_that_others_do_not_see(named: InProcess) -> None:
    with named.client(headers={HEADER: "ada"}) as ada, named.client(headers={HEADER: "bob"}) as bob:
        job = finish(ada, submit(ada, scene(8, 8)))
        assert job["user"] == "ada"
        assert ada.get("/v1/session").json() == {"user": "ada", "role": "submit", "keys_required": False}
        assert bob.get(f"/v1/jobs/{job['id']}").status_code == 404
        assert bob.get("/metrics").status_code == 403
        assert [found["id"] for found in ada.get("/v1/jobs").json()["jobs"]] == [job["id"]]


def test_user_who_is_not_named_once_is_refused(named: InProcess) -> None:
    for users in ((), ("",), ("a" * 65,), ("ada", "root"), ("a\tb",)):
        with named.client(headers=[(HEADER, user) for user in users]) as client:
            problem_of(client.get("/v1/jobs"), 403)
            assert client.get("/readyz").status_code == 200


def test_user_is_named_by_trusted_proxies_alone(named: InProcess) -> None:
    sent = {HEADER: "ada", "X-Forwarded-For": "127.0.0.1"}
    with named.client(transport=named.bridge.of("203.0.113.9"), headers=sent) as stranger:
        assert "trusted_proxies" in problem_of(stranger.get("/v1/jobs"), 403)["detail"]


def test_role_of_all_is_that_of_the_setting(tmp_path: Path) -> None:
    role = Role.STAFF
    settings = Settings(data=tmp_path, workers=1, behind_proxy=True, hosts="127.0.0.1", proxy_role=role)
    with in_process(settings) as local, local.client() as client:
        assert client.get("/v1/session").json()["role"] == role
        assert client.get("/metrics").status_code == 200
        assert client.post("/v1/prune", json={}).status_code == 403


@pytest.mark.slow
@pytest.mark.parametrize(
    ("trusted", "address", "believed"),
    [
        (None, "127.0.0.1", True),
        (None, PROXY, False),
        (f"10.0.0.0/8 {PROXY}", PROXY, True),
        ("10.0.0.5", "127.0.0.1", False),
    ],
)
def test_proxy_is_believed_on_loopback_or_where_it_is_named(
    tmp_path: Path, trusted: str | None, address: str, *, believed: bool
) -> None:
    key = make_keys(tmp_path, ada=Role.SUBMIT)["ada"]
    secure = {"X-Forwarded-Proto": "https", "Host": NAME}
    settings = Settings(
        data=tmp_path, port=0, workers=1, log_level="error", trusted_proxies=trusted, hosts=NAME
    )
    with (
        running(settings) as server,
        client_of(server, address=address) as client,
    ):
        cookie = client.post("/v1/session", headers=secure | bearer(key)).headers["Set-Cookie"]
        name, _, token = cookie.partition(";")[0].partition("=")
        assert name == ("__Host-penumbra_session" if believed else "penumbra_session")
        assert ("; Secure" in cookie, "; Path=/" in cookie) == (believed, True)
        assert "domain" not in cookie.lower()
        sent = secure | {"Cookie": f"{name}={token}"}
        assert client.get("/v1/session", headers=sent).json()["user"] == "ada"
        if believed:
            # Another host of the domain can set a cookie of this name, but none with the prefix.
            forged = secure | {"Cookie": f"penumbra_session={token}"}
            assert client.get("/v1/session", headers=forged).status_code == 401
            insecure = client.post("/v1/session", headers=bearer(key) | {"X-Forwarded-Proto": "http"})
            assert "; Secure" not in insecure.headers["Set-Cookie"]
        origins = {f"https://{NAME}": 202, f"https://{NAME}:8443": 403, "https://other": 403}
        for origin, status in origins.items():
            posted = client.post("/v1/jobs", json={"scene": scene(8, 8)}, headers=sent | {"Origin": origin})
            assert posted.status_code == status
