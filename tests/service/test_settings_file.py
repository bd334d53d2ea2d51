"""A service that is configured by a file."""

from __future__ import annotations

from pathlib import Path

import httpx2
import pytest

from service.server import running
from service.settings import Settings
from tests.service.support import TIMEOUT, scene


def test_a_service_keeps_the_limits_of_its_settings_file(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    file = tmp_path / "penumbra.toml"
    file.write_text(f'data = "{tmp_path / "data"}"\nport = 0\nworkers = 1\n\n[limits]\nmax_pixels = 100\n')
    monkeypatch.setenv("PENUMBRA_CONFIG", str(file))
    with running(Settings()) as server, httpx2.Client(base_url=server.url, timeout=TIMEOUT) as client:
        allowed, refused = (client.post("/v1/plans", json={"scene": scene(10, rows)}) for rows in (10, 11))
    assert allowed.status_code == 200
    assert (refused.status_code, refused.json()["errors"][0]["code"]) == (422, "over_limit")
    assert (tmp_path / "data").is_dir()
