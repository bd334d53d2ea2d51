"""What docs/how-to/proxy.md relies on, of the service and of the settings that it shows for a proxy."""

from __future__ import annotations

import re
import tomllib
from collections.abc import Iterator
from pathlib import Path

import httpx2
import pytest

from schemas.api.administration import Role
from service.access import keys
from service.server import RunningServer, running
from service.settings import MIB, Settings
from service.storage.database.connection import Database
from service.storage.database.migrations import upgrade
from tests.pages import blocks, page
from tests.service.support import TIMEOUT, scene

NAME = "render.example"


def block(language: str) -> str:
    """The first example of a language on the page."""
    return blocks(page("how-to/proxy.md"), language)[0]


def make_key(data: Path) -> str:
    """Make a key in the database of a data folder that is new."""
    database = Database(Settings(data=data).database_url)
    upgrade(database)
    with database.writing() as session:
        secret = str(keys.add(session, "ada", Role.SUBMIT))
    database.close()
    return secret


@pytest.fixture(scope="module")
def data(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return tmp_path_factory.mktemp("proxied")


@pytest.fixture(scope="module")
def key(data: Path) -> str:
    return make_key(data)


@pytest.fixture(scope="module")
def server(data: Path, key: str) -> Iterator[RunningServer]:
    """A service that requires keys, with the settings of the page."""
    shown = tomllib.loads(block("toml")) | {"data": data}
    with running(Settings(**shown, port=0, workers=1, log_level="error")) as started:
        yield started


@pytest.fixture
def client(server: RunningServer, key: str) -> Iterator[httpx2.Client]:
    """A proxy on this machine: it passes on the name that users call."""
    headers = {"Host": NAME, "X-Forwarded-Proto": "https", "Authorization": f"Bearer {key}"}
    with httpx2.Client(base_url=server.url, timeout=TIMEOUT, headers=headers) as opened:
        yield opened


def test_event_streams_are_not_buffered_by_a_proxy(client: httpx2.Client) -> None:
    job = client.post("/v1/jobs", json={"scene": scene(8, 8)}).json()["id"]
    with client.stream("GET", f"/v1/jobs/{job}/events") as stream:
        assert stream.headers["Content-Type"].startswith("text/event-stream")
        assert stream.headers["X-Accel-Buffering"] == "no"
        assert "event: end" in "".join(stream.iter_text())


@pytest.mark.parametrize(("scheme", "secure"), [("https", True), ("http", False)])
def test_the_cookie_of_a_session_is_secure_where_the_proxy_was_called_by_tls(
    client: httpx2.Client, scheme: str, secure: bool
) -> None:
    answer = client.post("/v1/session", headers={"X-Forwarded-Proto": scheme})
    assert answer.status_code == 200
    assert ("; Secure" in answer.headers["Set-Cookie"]) == secure


def test_a_proxy_on_this_machine_is_believed_only_if_others_are_not_named_in_its_place(
    tmp_path: Path,
) -> None:
    headers = {"X-Forwarded-Proto": "https", "Authorization": f"Bearer {make_key(tmp_path)}"}
    settings = Settings(data=tmp_path, port=0, workers=1, log_level="error", trusted_proxies="10.0.0.5")
    with running(settings) as server:
        answer = httpx2.post(f"{server.url}/v1/session", headers=headers, timeout=TIMEOUT)
    assert answer.status_code == 200
    assert "; Secure" not in answer.headers["Set-Cookie"]


@pytest.mark.parametrize(
    ("origin", "status"), [(f"https://{NAME}", 202), (f"https://{NAME}:8443", 403), ("https://other", 403)]
)
def test_a_page_may_submit_where_the_proxy_passes_the_host_of_its_origin(
    client: httpx2.Client, server: RunningServer, origin: str, status: int
) -> None:
    begun = client.post("/v1/session")
    cookie = begun.headers["Set-Cookie"].partition(";")[0]
    headers = {"Host": NAME, "X-Forwarded-Proto": "https", "Origin": origin, "Cookie": cookie}
    answer = httpx2.post(
        f"{server.url}/v1/jobs", json={"scene": scene(8, 8)}, headers=headers, timeout=TIMEOUT
    )
    assert answer.status_code == status


def test_the_proxies_of_the_page_let_the_largest_upload_and_the_longest_wait_through() -> None:
    usual = Settings()
    largest = max(usual.max_asset_bytes, usual.trace_limits.max_body_bytes)
    shown = block("nginx") + block("caddyfile")
    sizes = re.findall(r"(?:client_max_body_size|max_size) (\d+)(?:m;|MiB)", shown)
    assert [int(size) * MIB for size in sizes] == [largest, largest]
    (seconds,) = re.findall(r"proxy_read_timeout (\d+)s;", shown)
    assert int(seconds) > max(usual.max_wait_seconds, usual.heartbeat_seconds)
