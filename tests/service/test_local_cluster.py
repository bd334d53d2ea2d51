"""The cluster that a service starts itself: every user of the machine reaches its ports."""

from __future__ import annotations

import asyncio
from collections.abc import Iterator

import httpx2
import psutil
import pytest
from distributed import Security
from distributed.comm import connect

from service.server import RunningServer
from tests.service.conftest import Start
from tests.service.support import TIMEOUT, finish, scene, submit

pytestmark = pytest.mark.slow

CONNECT_SECONDS = 3.0
STRANGERS = {"tcp": Security(require_encryption=False), "tls": Security.temporary()}
"""How somebody connects who has no certificate of the cluster, by the scheme."""


def ports(server: RunningServer) -> Iterator[int]:
    """Ports on which the server and its workers listen."""
    process = psutil.Process(server.process.pid)
    for one in (process, *process.children(recursive=True)):
        yield from (
            found.laddr.port for found in one.net_connections("inet") if found.status == psutil.CONN_LISTEN
        )


async def takes_orders(port: int, scheme: str) -> bool:
    """Whether a stranger is let in there: a scheduler or worker then runs the stranger's code."""
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


def test_other_users_of_the_machine_give_no_orders_to_the_cluster_that_a_service_starts(start: Start) -> None:
    server = start(engine="dask", workers=1)
    with httpx2.Client(base_url=server.url, timeout=TIMEOUT) as client:
        finish(client, submit(client, scene()))
        found = list(ports(server))
        assert len(found) > 2
        assert asyncio.run(open_to_strangers(found)) == []
