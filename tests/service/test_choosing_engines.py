"""Engines and clusters that a service does not start with."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest

from schemas.api.administration import Role
from service.access import keys
from service.errors import EngineError, UnsafeClusterError
from service.settings import Settings
from service.storage.database.connection import Database
from service.storage.database.migrations import upgrade
from service.workers.engines import check_engine
from tests.service.conftest import Start

FILES = ("dask_tls_ca", "dask_tls_cert", "dask_tls_key")


def check(address: str, *, keys_made: bool = False, **settings: Any) -> None:
    given = {"engine": "dask", "dask": address, **settings}
    check_engine(Settings.model_validate(given), keys_made=keys_made)


@pytest.fixture
def certificates(tmp_path: Path) -> dict[str, Path]:
    files = {name: tmp_path / f"{name}.pem" for name in FILES}
    for path in files.values():
        path.touch()
    return files


@pytest.mark.parametrize("host", ["localhost", "127.0.0.1", "[::1]"])
def test_a_cluster_of_this_machine_alone_needs_no_certificates(host: str) -> None:
    check(f"tcp://{host}:8786")


@pytest.mark.parametrize("host", ["10.0.0.7", "scheduler.example.org", "[2001:db8::7]"])
def test_a_cluster_elsewhere_without_encryption_is_refused_and_the_cure_is_named(host: str) -> None:
    with pytest.raises(UnsafeClusterError) as caught:
        check(f"tcp://{host}:8786")
    assert f"tls://{host}:8786" in str(caught.value)
    assert "dask_tls_ca" in str(caught.value)


def test_where_keys_are_required_a_cluster_of_this_machine_needs_certificates_too(
    certificates: dict[str, Path],
) -> None:
    with pytest.raises(UnsafeClusterError, match="tls://localhost:8786") as caught:
        check("tcp://localhost:8786", keys_made=True)
    assert "dask_tls_ca" in str(caught.value)
    check("tls://localhost:8786", keys_made=True, **certificates)
    check("tcp://localhost:8786", keys_made=True, dask_trusted_network=True)


def test_a_server_with_keys_does_not_start_with_a_cluster_that_has_none(
    start: Start, tmp_path: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    database = Database(Settings(data=tmp_path).database_url)
    upgrade(database)
    with database.writing() as session:
        keys.add(session, "ann", Role.SUBMIT)
    database.close()
    with pytest.raises(Exception, match="ended with code"):
        start(engine="dask", dask="tcp://127.0.0.1:8786")
    assert "every user of this machine" in capfd.readouterr().err


def test_a_network_that_is_trusted_needs_no_certificates() -> None:
    check("tcp://10.0.0.7:8786", dask_trusted_network=True)


@pytest.mark.parametrize("missing", FILES)
def test_a_certificate_that_is_not_named_is_reported(certificates: dict[str, Path], missing: str) -> None:
    with pytest.raises(UnsafeClusterError, match=f"Set {missing} as well"):
        check("tls://10.0.0.7:8786", **{name: path for name, path in certificates.items() if name != missing})


def test_a_certificate_that_is_not_there_is_reported(certificates: dict[str, Path]) -> None:
    certificates["dask_tls_key"].unlink()
    with pytest.raises(UnsafeClusterError, match=r"dask_tls_key\.pem"):
        check("tls://10.0.0.7:8786", **certificates)


@pytest.mark.parametrize("address", ["scheduler:8786", "http://localhost:8786", "tcp://", "tls://:8786"])
def test_what_is_no_address_of_a_scheduler_is_refused(address: str) -> None:
    with pytest.raises(UnsafeClusterError, match="tls://host:8786"):
        check(address)


def test_a_cluster_that_would_not_be_used_is_refused() -> None:
    with pytest.raises(EngineError, match="Give --engine dask"):
        check("tcp://localhost:8786", engine="slots")


def test_a_server_does_not_start_with_an_unsafe_cluster(
    start: Start, capfd: pytest.CaptureFixture[str]
) -> None:
    with pytest.raises(Exception, match="ended with code"):
        start(engine="dask", dask="tcp://10.0.0.7:8786")
    assert "is not encrypted" in capfd.readouterr().err
