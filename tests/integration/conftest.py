"""A real server in a process of its own, one for all tests that leave it as it was."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import ExitStack
from pathlib import Path
from typing import Any

import httpx2
import pytest

from schemas.limits import Limits
from service.server import RunningServer, running
from service.settings import Settings
from tests.integration.support import PATIENCE

Start = Callable[..., RunningServer]


def _settings(data: Path, **changes: Any) -> Settings:
    return Settings(**({"data": data, "port": 0, "workers": 2, "log_level": "error"} | changes))


@pytest.fixture(scope="session")
def server(tmp_path_factory: pytest.TempPathFactory) -> Iterator[RunningServer]:
    settings = _settings(
        tmp_path_factory.mktemp("service"),
        tile_size=32,
        max_cpu_seconds=600,
        max_wait_seconds=5,
        max_asset_bytes=200_000,
        max_asset_pixels=1_000_000,
        max_trace_rays=1000,
        limits=Limits(max_body_bytes=1_000_000, max_pixels=1_000_000, max_samples=1024, max_shapes=100),
    )
    with running(settings) as started:
        yield started


@pytest.fixture
def client(server: RunningServer) -> Iterator[httpx2.Client]:
    with httpx2.Client(base_url=server.url, timeout=PATIENCE) as opened:
        yield opened


@pytest.fixture
def start(tmp_path: Path) -> Iterator[Start]:
    """Start servers of one's own; all use the same data folder."""
    with ExitStack() as stack:

        def begin(**changes: Any) -> RunningServer:
            return stack.enter_context(running(_settings(tmp_path, **changes)))

        yield begin
