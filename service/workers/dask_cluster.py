"""Reaching a Dask cluster, or starting a small one on this machine."""

from __future__ import annotations

import logging
from collections.abc import AsyncIterator, Callable
from contextlib import AbstractAsyncContextManager, asynccontextmanager

import dask.config
from distributed import Client, LocalCluster, Security

from service.settings import Settings

Connect = Callable[[], AbstractAsyncContextManager[Client]]
"""Gives a client of the cluster for as long as a block lasts."""

CONNECT_SECONDS = 5.0
# A worker that dies takes its tasks with it, none is moved once it is somewhere, and a worker may have a
# process of its own. deploy/dask.yaml has the same for clusters that operators run.
LOCAL = {
    "distributed.scheduler.allowed-failures": 0,
    "distributed.scheduler.work-stealing": False,
    "distributed.scheduler.worker-ttl": "30s",
    "distributed.worker.daemon": False,
    "distributed.worker.profile.enabled": False,
}


def connector(settings: Settings) -> Connect:
    """Say how to reach the cluster that the settings name, or start one where they name none."""
    # What it does at every start and stop is nobody's news.
    logging.getLogger("distributed").setLevel(logging.WARNING)
    # The engine itself logs what becomes of the connection.
    logging.getLogger("distributed.client").setLevel(logging.CRITICAL)
    address = settings.dask
    return (lambda: _existing(address, settings)) if address else (lambda: _local(settings.workers))


@asynccontextmanager
async def _existing(address: str, settings: Settings) -> AsyncIterator[Client]:
    async with Client(
        address,
        asynchronous=True,
        security=_security(address, settings),
        timeout=CONNECT_SECONDS,
        set_as_default=False,
    ) as client:
        yield client


def _security(address: str, settings: Settings) -> Security | None:
    if not address.startswith("tls:"):
        return None
    return Security(
        require_encryption=True,
        tls_ca_file=str(settings.dask_tls_ca),
        tls_client_cert=str(settings.dask_tls_cert),
        tls_client_key=str(settings.dask_tls_key),
    )


@asynccontextmanager
async def _local(workers: int) -> AsyncIterator[Client]:
    with dask.config.set(LOCAL):
        async with (
            LocalCluster(
                n_workers=workers,
                threads_per_worker=1,
                host="127.0.0.1",
                memory_limit=0,
                # Any free port: two services may be developed at once.
                dashboard_address="127.0.0.1:0",
                worker_dashboard_address="127.0.0.1:0",
                asynchronous=True,
            ) as cluster,
            Client(cluster, asynchronous=True, set_as_default=False) as client,
        ):
            yield client
