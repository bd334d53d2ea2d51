"""Real servers in their own processes, and real databases, shared by tests that leave them unchanged."""

from collections.abc import Callable, Iterator
from contextlib import ExitStack
from pathlib import Path
from typing import Any

import httpx2
import numpy as np
import pytest

import renderer
from schemas.limits import Limits
from service.server import RunningServer
from service.settings import Settings
from service.storage.database.connection import Database
from service.storage.database.migrations import upgrade
from tests.postgres_server import PostgresServer, programs
from tests.s3_server import S3Server
from tests.service.forking import running
from tests.service.in_process import InProcess, in_process
from tests.service.support import TIMEOUT, work

Start = Callable[..., RunningServer]


def _settings(data: Path, **changes: Any) -> Settings:
    return Settings(**({"data": data, "port": 0, "workers": 2, "log_level": "error"} | changes))


def typical(data: Path, **changes: Any) -> Settings:
    return _settings(
        data,
        tile_size=32,
        max_cpu_seconds=600,
        max_wait_seconds=20,
        max_asset_bytes=200_000,
        max_trace_rays=1000,
        limits=Limits(
            max_body_bytes=1_000_000,
            max_pixels=1_000_000,
            max_samples=1024,
            max_shapes=100,
            max_image_pixels=1_000_000,
        ),
        **changes,
    )


@pytest.fixture(scope="session")
def server(tmp_path_factory: pytest.TempPathFactory) -> Iterator[RunningServer]:
    with running(typical(tmp_path_factory.mktemp("service"))) as started:
        yield started


@pytest.fixture(scope="session")
def server_on_postgres(
    tmp_path_factory: pytest.TempPathFactory, postgres: PostgresServer
) -> Iterator[RunningServer]:
    settings = typical(tmp_path_factory.mktemp("service"), database=postgres.database())
    with running(settings) as started:
        yield started


@pytest.fixture
def client(request: pytest.FixtureRequest) -> Iterator[httpx2.Client]:
    """Who asks a server on SQLite, and one on PostgreSQL too where a test is marked ``ON_BOTH``."""
    on = "server_on_postgres" if getattr(request, "param", "sqlite") == "postgresql" else "server"
    server: RunningServer = request.getfixturevalue(on)
    with httpx2.Client(base_url=server.url, timeout=TIMEOUT) as opened:
        yield opened


@pytest.fixture(scope="session")
def local(tmp_path_factory: pytest.TempPathFactory) -> Iterator[InProcess]:
    """A service in this process, on SQLite."""
    with in_process(typical(tmp_path_factory.mktemp("local"))) as made:
        yield made


@pytest.fixture(scope="session")
def local_on_postgres(
    tmp_path_factory: pytest.TempPathFactory, postgres: PostgresServer
) -> Iterator[InProcess]:
    with in_process(typical(tmp_path_factory.mktemp("local"), database=postgres.database())) as made:
        yield made


@pytest.fixture
def api(request: pytest.FixtureRequest) -> Iterator[httpx2.Client]:
    """A client of the service in this process: on SQLite, and on PostgreSQL where marked ``API_ON_BOTH``."""
    on = "local_on_postgres" if getattr(request, "param", "sqlite") == "postgresql" else "local"
    made: InProcess = request.getfixturevalue(on)
    with made.client() as opened:
        yield opened


@pytest.fixture
def start(tmp_path: Path) -> Iterator[Start]:
    """Start servers of one's own; all use the same data folder."""
    with ExitStack() as stack:

        def begin(**changes: Any) -> RunningServer:
            return stack.enter_context(running(_settings(tmp_path, **changes)))

        yield begin


@pytest.fixture(scope="session")
def postgres() -> Iterator[PostgresServer]:
    found = programs()
    if found is None:
        pytest.skip(
            "no programs of PostgreSQL (initdb, postgres) on this machine: apt-get install postgresql"
        )
    server = PostgresServer(found)
    yield server
    server.close()


@pytest.fixture
def database(request: pytest.FixtureRequest, tmp_path: Path) -> Iterator[Database]:
    """A database of this version: SQLite, and PostgreSQL too where a test is marked ``BOTH``."""
    if getattr(request, "param", "sqlite") == "sqlite":
        database = Database(f"sqlite:///{tmp_path / 'test.sqlite'}")
        upgrade(database)
    else:
        database = request.getfixturevalue("postgres").emptied()
    yield database
    database.close()


@pytest.fixture(scope="module")
def object_store() -> Iterator[S3Server]:
    """An S3-compatible server, which this process and all that it starts find by their variables."""
    server = S3Server()
    with pytest.MonkeyPatch.context() as patch:
        for name, value in server.environment().items():
            patch.setenv(name, value)
        yield server
    server.close()


@pytest.fixture(scope="session")
def undisturbed() -> np.ndarray:
    """The picture of `work`, rendered in this process."""
    return renderer.render(renderer.compile_scene(work()), workers=2).image
