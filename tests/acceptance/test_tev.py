"""A job's picture in tev, simulated by a server that reads packets as tev documents them."""

from __future__ import annotations

import socket
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest

from service.client import Client
from tests.acceptance.conftest import Penumbra, Server
from tests.tev_server import CREATE, UPDATE_V3, TevServer


@pytest.fixture
def tev() -> Iterator[TevServer]:
    server = TevServer()
    yield server
    server.listener.close()


@pytest.fixture
def job(server: Server, scene_file: Path) -> Iterator[str]:
    """The identifier of a job that has been sent."""
    with Client(server.url) as client:
        yield client.submit(scene_file).id


@pytest.mark.slow
def test_tev_has_every_pixel_of_the_picture_in_the_end(
    penumbra: Penumbra, server: Server, job: str, tev: TevServer
) -> None:
    assert penumbra("watch", job, "--tev", tev.address).code == 0
    tev.close()
    with Client(server.url) as client:
        np.testing.assert_array_equal(tev.picture(f"penumbra {job}"), client.pixels(job))
    assert tev.kinds[0] == CREATE
    assert set(tev.kinds[1:]) == {UPDATE_V3}


@pytest.mark.slow
def test_where_tev_is_away_the_job_is_watched_without_it(penumbra: Penumbra, job: str) -> None:
    with socket.create_server(("127.0.0.1", 0)) as closed:
        address = f"127.0.0.1:{closed.getsockname()[1]}"
    outcome = penumbra("watch", job, "--tev", address)
    assert outcome.code == 0
    assert address in outcome.err
    assert outcome.out.count("\ttile ") > 1


@pytest.mark.slow
def test_where_tev_goes_away_the_job_is_watched_without_it(penumbra: Penumbra, job: str) -> None:
    leaving = TevServer(packets=1)
    outcome = penumbra("watch", job, "--tev", leaving.address)
    leaving.close()
    assert outcome.code == 0
    assert leaving.kinds == [CREATE]
    assert outcome.out.count("\ttile ") > 1
