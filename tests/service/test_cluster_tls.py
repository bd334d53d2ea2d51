"""A Dask cluster with the certificates that the project's own script makes."""

from __future__ import annotations

import asyncio
import shutil
import subprocess
from collections.abc import Iterator
from pathlib import Path

import httpx2
import pytest
from distributed import Client, Security

from service.server import running
from service.settings import Settings
from tests.service.dask_cluster import Cluster
from tests.service.support import TIMEOUT, finish, scene, submit

pytestmark = [
    pytest.mark.slow,
    pytest.mark.skipif(not shutil.which("openssl"), reason="openssl is not installed"),
]

SCRIPT = Path(__file__).parents[2] / "deploy" / "certificates.sh"


def made_in(folder: Path) -> Path:
    subprocess.run(["sh", str(SCRIPT), str(folder)], check=True, capture_output=True)
    return folder


@pytest.fixture(scope="module")
def certificates(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return made_in(tmp_path_factory.mktemp("certificates"))


@pytest.fixture(scope="module")
def cluster(certificates: Path) -> Iterator[Cluster]:
    files = {"ca-file": "authority.pem", "cert": "cluster.pem", "key": "cluster.key"}
    options = [f"--tls-{name}={certificates / file}" for name, file in files.items()]
    started = Cluster(*options, scheme="tls")
    started.start_worker()
    yield started
    started.close()


def test_a_picture_is_rendered_on_a_cluster_with_certificates(
    cluster: Cluster, certificates: Path, tmp_path: Path
) -> None:
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


def test_who_has_no_certificate_of_the_authority_gives_no_orders(
    cluster: Cluster, certificates: Path, tmp_path: Path
) -> None:
    assert asyncio.run(connects(cluster.address, certificates))
    assert not asyncio.run(connects(cluster.address, made_in(tmp_path)))
    assert not asyncio.run(connects(cluster.address.replace("tls:", "tcp:"), None))


async def connects(address: str, folder: Path | None) -> bool:
    security = folder and Security(
        tls_ca_file=str(folder / "authority.pem"),
        tls_client_cert=str(folder / "cluster.pem"),
        tls_client_key=str(folder / "cluster.key"),
        require_encryption=True,
    )
    try:
        async with Client(address, security=security, asynchronous=True, timeout=TIMEOUT / 20) as client:
            return bool(client.status == "running")
    except OSError:
        return False


def test_only_the_user_reads_the_keys(certificates: Path) -> None:
    assert {path.stat().st_mode & 0o077 for path in certificates.iterdir()} == {0}
