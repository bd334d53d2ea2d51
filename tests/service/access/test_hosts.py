"""Names that a service answers to: a page of another site can have its own name lead to loopback."""

from pathlib import Path

import httpx2
import pytest

from service.settings import Settings
from tests.service.in_process import in_process
from tests.service.sending import problem_of

EVIL = "rebound.example"


@pytest.mark.parametrize("host", [EVIL, f"{EVIL}:8000", "127.0.0.1.rebound.example", "[::1", "10.1.2.3", ""])
def test_host_of_another_site_is_refused(api: httpx2.Client, host: str) -> None:
    headers = {"Host": host, "Origin": f"http://{host}", "Sec-Fetch-Site": "same-origin"}
    for path in ("/v1/jobs", "/metrics", "/v1/session"):
        assert problem_of(api.get(path, headers=headers), 421)["code"] == "unknown_host"
    posted = api.post("/v1/jobs", headers=headers)
    # A malformed origin is refused as one of another site, before the name is checked.
    assert posted.json()["code"] in {"unknown_host", "cross_site"}


@pytest.mark.parametrize("host", ["localhost", "LOCALHOST:1", "127.0.0.1", "127.8.9.10:8000", "[::1]:8000"])
def test_host_of_loopback_is_answered(api: httpx2.Client, host: str) -> None:
    assert api.get("/v1/jobs", headers={"Host": host}).status_code == 200


def test_hosts_behind_a_proxy_are_those_of_the_settings(tmp_path: Path) -> None:
    settings = Settings(
        data=tmp_path, workers=1, behind_proxy=True, proxy_role="admin", hosts="127.0.0.1 render.example"
    )
    statuses = {"render.example": 200, "Render.Example:443": 200, EVIL: 421, "localhost": 421}
    with in_process(settings) as local, local.client() as client:
        found = {host: client.get("/v1/jobs", headers={"Host": host}).status_code for host in statuses}
    assert found == statuses
