"""Clusters that a service does not start with, and who gives orders to those that it uses."""

import asyncio
import shutil
import subprocess
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import httpx2
import psutil
import pytest
from distributed import Client, Security
from distributed.comm import connect

from schemas.api.administration import Role
from service.access import keys
from service.errors import UnsafeClusterError
from service.server import RunningServer
from service.settings import Settings
from service.storage.database.connection import Database
from service.storage.database.migrations import upgrade
from service.workers.engines import check_engine
from tests.service.conftest import Start
from tests.service.dask_cluster import Cluster
from tests.service.forking import running
from tests.service.support import TIMEOUT, finish, scene, submit

FILES = ("dask_tls_ca", "dask_tls_cert", "dask_tls_key")
SCRIPT = Path(__file__).parents[3] / "deploy" / "certificates.sh"
CONNECT_SECONDS = 3.0
STRANGERS = {"tcp": Security(require_encryption=False), "tls": Security.temporary()}
"""Connection arguments of a stranger without a certificate of the cluster, by scheme."""
NEEDS_OPENSSL = pytest.mark.skipif(not shutil.which("openssl"), reason="openssl is not installed")


def check(address: str, *, keys_made: bool = False, **settings: Any) -> None:
    given = {"engine": "dask", "dask": address, **settings}
    check_engine(Settings.model_validate(given), keys_made=keys_made)


@pytest.fixture
def empty(tmp_path: Path) -> dict[str, Path]:
    """Files that are named as certificates."""
    files = {name: tmp_path / f"{name}.pem" for name in FILES}
    for path in files.values():
        path.touch()
    return files


@pytest.mark.parametrize("host", ["localhost", "127.0.0.1", "[::1]"])
def test_cluster_of_this_machine_needs_no_certificates(host: str) -> None:
    check(f"tcp://{host}:8786")


@pytest.mark.parametrize("host", ["10.0.0.7", "scheduler.example.org", "[2001:db8::7]"])
def test_cluster_elsewhere_without_encryption_is_refused(host: str) -> None:
    with pytest.raises(UnsafeClusterError) as caught:
        check(f"tcp://{host}:8786")
    assert f"tls://{host}:8786" in str(caught.value)
    check(f"tcp://{host}:8786", dask_trusted_network=True)


def test_cluster_of_a_service_with_keys_needs_certificates(empty: dict[str, Path]) -> None:
    with pytest.raises(UnsafeClusterError, match="tls://localhost:8786"):
        check("tcp://localhost:8786", keys_made=True)
    check("tls://localhost:8786", keys_made=True, **empty)
    check("tcp://localhost:8786", keys_made=True, dask_trusted_network=True)


@pytest.mark.parametrize("address", ["scheduler:8786", "http://localhost:8786", "tcp://", "tls://:8786"])
def test_address_of_no_scheduler_is_refused(address: str) -> None:
    with pytest.raises(UnsafeClusterError, match="tls://host:8786"):
        check(address)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("address", "reason"),
    [("tcp://10.0.0.7:8786", "is not encrypted"), ("tcp://127.0.0.1:8786", "every user of this machine")],
)
def test_server_with_keys_does_not_start_with_an_unsafe_cluster(
    start: Start, tmp_path: Path, capfd: pytest.CaptureFixture[str], address: str, reason: str
) -> None:
    database = Database(Settings(data=tmp_path).database_url)
    upgrade(database)
    with database.writing() as session:
        keys.add(session, "ann", Role.SUBMIT)
    database.close()
    with pytest.raises(Exception, match="ended with code"):
        start(engine="dask", dask=address)
    assert reason in capfd.readouterr().err


def make_certificates(folder: Path) -> Path:
    subprocess.run(["sh", str(SCRIPT), str(folder)], check=True, capture_output=True)
    return folder


@pytest.fixture(scope="module")
def certificates(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return make_certificates(tmp_path_factory.mktemp("certificates"))


@pytest.fixture(scope="module")
def cluster(certificates: Path) -> Iterator[Cluster]:
    files = {"ca-file": "authority.pem", "cert": "cluster.pem", "key": "cluster.key"}
    options = [f"--tls-{name}={certificates / file}" for name, file in files.items()]
    started = Cluster(*options, scheme="tls")
    started.start_worker()
    yield started
    started.close()


@pytest.mark.slow
@NEEDS_OPENSSL
def test_cluster_with_certificates_renders(cluster: Cluster, certificates: Path, tmp_path: Path) -> None:
    settings = Settings(
        data=tmp_path,
        port=0,
        log_level="error",
        engine="dask",
        dask=cluster.address,
        dask_tls_ca=certificates / "authority.pem",
        dask_tls_cert=certificates / "cluster.pem",
        dask_tls_key=certificates / "cluster.key",
    )
    with running(settings) as server, httpx2.Client(base_url=server.url, timeout=TIMEOUT) as client:
        finish(client, submit(client, scene()))


@pytest.mark.slow
@NEEDS_OPENSSL
def test_cluster_takes_no_orders_without_its_certificate(
    cluster: Cluster, certificates: Path, tmp_path: Path
) -> None:
    assert asyncio.run(connects(cluster.address, certificates))
    assert not asyncio.run(connects(cluster.address, make_certificates(tmp_path)))
    assert not asyncio.run(connects(cluster.address.replace("tls:", "tcp:"), None))
    # Only the user reads the keys.
    assert {path.stat().st_mode & 0o077 for path in certificates.iterdir()} == {0}


async def connects(address: str, folder: Path | None) -> bool:
    security = folder and Security(
        tls_ca_file=str(folder / "authority.pem"),
        tls_client_cert=str(folder / "cluster.pem"),
        tls_client_key=str(folder / "cluster.key"),
        require_encryption=True,
    )
    try:
        async with Client(address, security=security, asynchronous=True, timeout=CONNECT_SECONDS) as client:
            return bool(client.status == "running")
    except OSError:
        return False


def ports(server: RunningServer) -> Iterator[int]:
    """Ports on which the server and its workers listen."""
    process = psutil.Process(server.process.pid)
    for one in (process, *process.children(recursive=True)):
        listening = (each for each in one.net_connections("inet") if each.status == psutil.CONN_LISTEN)
        yield from (each.laddr.port for each in listening)


async def takes_orders(port: int, scheme: str) -> bool:
    """Whether a stranger can connect, and so run code in the scheduler or worker."""
    options = STRANGERS[scheme].get_connection_args("client")
    try:
        # A server of another protocol may say nothing at all.
        async with asyncio.timeout(2 * CONNECT_SECONDS):
            connection = await connect(f"{scheme}://127.0.0.1:{port}", timeout=CONNECT_SECONDS, **options)
    except (OSError, ValueError):
        # ValueError where a server without TLS speaks first.
        return False
    connection.abort()
    return True


async def open_to_strangers(found: list[int]) -> list[tuple[int, str]]:
    tried = [(port, scheme) for port in found for scheme in STRANGERS]
    answers = await asyncio.gather(*(takes_orders(*one) for one in tried))
    return [one for one, answer in zip(tried, answers, strict=True) if answer]


@pytest.mark.slow
def test_cluster_of_a_service_takes_no_orders_from_other_users(start: Start) -> None:
    server = start(engine="dask", workers=1)
    with httpx2.Client(base_url=server.url, timeout=TIMEOUT) as client:
        finish(client, submit(client, scene()))
        found = list(ports(server))
        assert len(found) > 2
        assert asyncio.run(open_to_strangers(found)) == []
