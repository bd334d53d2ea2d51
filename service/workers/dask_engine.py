"""The engine for many machines: tasks go to the workers of a Dask cluster, one slot each.

The cluster keeps no state: tasks lost with a worker or the scheduler are reported as interrupted, and the
dispatcher hands them out again from the database.
"""

from __future__ import annotations

import asyncio
import logging
import threading
import time
from collections.abc import AsyncIterator, Callable, Coroutine
from contextlib import AbstractAsyncContextManager, asynccontextmanager, suppress
from dataclasses import dataclass
from math import inf
from uuid import uuid4

import dask.config
import structlog
from distributed import Client, Future, KilledWorker, LocalCluster, Security
from distributed.client import FutureCancelledError

from service.errors import UnusableWorkerError
from service.settings import Settings
from service.supervision import SupervisedThread
from service.workers.dask_worker import BEGUN_TOPIC, PLUGIN_NAME, SlotPlugin, execute, stop
from service.workers.states import WorkerState
from service.workers.tasks import Interrupted, Outcome, Report, Task, TaskFailed, WorkerDied
from service.workers.worker import WorkerSetup

# Tasks per worker: one runs, and the others are ready when it ends.
TASKS_PER_WORKER = 3
# Seconds between checks of the cluster's workers.
WATCH_SECONDS = 1.0
# Seconds before the next try after a cluster has failed.
RETRY_SECONDS = 1.0
# How long the workers may take to stop when the service does, seconds.
FAREWELL_SECONDS = 3.0
log = structlog.get_logger()


@dataclass(eq=False)
class _Flight:
    """A task that was handed to the cluster; ``worker`` is where it has begun."""

    key: str
    task: Task
    future: Future
    worker: str | None = None
    begun: float = 0.0
    stopping: bool = False


class DaskEngine:
    """Runs tasks on the workers of a Dask cluster, which may come and go.

    Parameters
    ----------
    connect : callable
        Gives a client of the cluster, as a context.
    setup : WorkerSetup
        Settings of every slot.
    """

    def __init__(self, connect: Connect, setup: WorkerSetup) -> None:
        self._connect, self._setup = connect, setup
        # Its event loop is not replaced: the service starts again with another.
        self._thread = SupervisedThread("dask", self._run, most_failures=1)
        self._started = threading.Event()
        self._lock = threading.Lock()
        self._load = self._workers = 0
        # Used only by the thread with the event loop.
        self._client: Client | None = None
        self._flights: dict[str, _Flight] = {}
        self._addresses: tuple[str, ...] = ()
        self._following: set[asyncio.Task[None]] = set()

    def start(self, report: Report) -> None:
        """Begin to look for the cluster; tasks are taken once it is there."""
        self._report = report
        self._thread.start()
        self._started.wait()

    def room(self) -> int:
        """Number of tasks that can be submitted now; 0 without a cluster."""
        with self._lock:
            return max(0, TASKS_PER_WORKER * self._workers - self._load)

    def idle(self) -> int:
        """Number of idle workers; 0 without a cluster."""
        with self._lock:
            return max(0, self._workers - self._load)

    def spare(self) -> int:
        """None: a cluster has the workers that it has."""
        return 0

    def submit(self, task: Task, *, spare: bool = False) -> None:  # noqa: ARG002  (an interface)
        """Give a task to the cluster, which chooses the worker."""
        with self._lock:
            self._load += 1
        self._loop.call_soon_threadsafe(self._begin, task)

    def interrupt(self, wanted: Callable[[Task], bool]) -> None:
        """Take back the tasks that are ``wanted``; where one runs, its process is killed."""
        self._loop.call_soon_threadsafe(self._interrupt, wanted)

    def workers(self) -> list[WorkerState]:
        """States of the cluster's workers; none without a cluster."""
        running = {flight.worker: flight for flight in tuple(self._flights.values())}
        return [_state(address, running.get(address)) for address in self._addresses]

    def alive(self) -> bool:
        """Whether the cluster is there and has a worker."""
        return self._workers > 0

    def close(self) -> None:
        """Stop all tasks and leave the cluster; one of this engine's own ends."""
        self._report = _drop_report
        self._loop.call_soon_threadsafe(self._main.cancel)
        self._thread.stop()

    def _run(self) -> None:
        with suppress(asyncio.CancelledError):
            asyncio.run(self._live())

    async def _live(self) -> None:
        """Use the cluster; look for it again whenever it is lost."""
        self._loop = asyncio.get_running_loop()
        main = asyncio.current_task()
        assert main is not None
        self._main = main
        self._started.set()
        while True:
            try:
                async with self._connect() as client:
                    await self._serve(client)
            except (OSError, TimeoutError, RuntimeError) as error:
                log.warning("cluster unavailable; retrying", reason=str(error) or type(error).__name__)
            except Exception:
                log.exception("cluster unavailable; retrying")
            await asyncio.sleep(RETRY_SECONDS)

    async def _serve(self, client: Client) -> None:
        """Take tasks until the connection is lost."""
        connection = client.scheduler_comm
        try:
            client.subscribe_topic(BEGUN_TOPIC, self._note_begun)
            await _prepare(client, SlotPlugin(self._setup))
            self._client = client
            # A client that has connected again has another scheduler, which knows nothing of the slots.
            while client.status == "running" and client.scheduler_comm is connection:
                self._addresses = tuple(await client.nthreads())
                self._workers = len(self._addresses)
                await asyncio.sleep(WATCH_SECONDS)
            log.warning("cluster lost; reconnecting")
        finally:
            self._client, self._workers, self._addresses = None, 0, ()
            if client.status == "running":
                with suppress(OSError, TimeoutError):
                    await asyncio.wait_for(client.run(stop, None, on_error="ignore"), FAREWELL_SECONDS)

    def _begin(self, task: Task) -> None:
        key = f"{type(task).__name__}-{uuid4().hex}"
        if self._client is None:
            self._end(task, Interrupted())
            return
        try:
            future = self._client.submit(execute, key, task, key=key, pure=False)
        except Exception as error:  # noqa: BLE001  (such as MemoryError: another task may be smaller)
            reason = f"The task could not be sent to the cluster: {type(error).__name__}."
            is_lost = self._client.status != "running"
            self._end(task, Interrupted() if is_lost else TaskFailed("render_failed", reason))
            return
        self._flights[key] = flight = _Flight(key, task, future)
        self._follow(self._await(flight))

    async def _await(self, flight: _Flight) -> None:
        outcome = await _outcome(flight)
        del self._flights[flight.key]
        flight.future.release()
        self._end(flight.task, outcome)

    def _end(self, task: Task, outcome: Outcome) -> None:
        with self._lock:
            self._load -= 1
        self._report(task, outcome)

    def _note_begun(self, event: tuple[float, dict[str, str]]) -> None:
        flight = self._flights.get(event[1]["key"])
        if flight is not None:
            flight.worker, flight.begun = event[1]["worker"], time.monotonic()

    def _interrupt(self, wanted: Callable[[Task], bool]) -> None:
        for flight in self._flights.values():
            if not flight.stopping and wanted(flight.task):
                flight.stopping = True
                self._follow(self._stop(flight))

    async def _stop(self, flight: _Flight) -> None:
        """Take back a task that has not begun, and kill the process of one that has: it writes no more."""
        client = self._client
        if client is None:
            return
        if flight.worker is None:
            await client.cancel([flight.future])
            return
        with suppress(OSError, TimeoutError):
            await client.run(stop, flight.key, workers=[flight.worker], on_error="ignore")
        flight.stopping = False

    def _follow(self, coroutine: Coroutine[None, None, None]) -> None:
        # The event loop itself does not keep what it runs.
        following = self._loop.create_task(coroutine)
        self._following.add(following)
        following.add_done_callback(self._following.discard)


def _state(address: str, flight: _Flight | None) -> WorkerState:
    if flight is None:
        return WorkerState(address, None, None, 0.0)
    return WorkerState(address, None, flight.task, time.monotonic() - flight.begun)


async def _prepare(client: Client, plugin: SlotPlugin) -> None:
    """Give every worker a slot, those included that come later."""
    try:
        await client.register_plugin(plugin, name=PLUGIN_NAME)
    except UnusableWorkerError as error:
        # It leaves by itself; the others are good.
        log.error("worker unusable", reason=str(error))  # noqa: TRY400  (the reason is enough)


async def _outcome(flight: _Flight) -> Outcome:
    """Wait until a task has ended, or is lost."""
    try:
        outcome: Outcome = await flight.future
    except (FutureCancelledError, OSError):
        # The scheduler is gone, or the worker was before it had reported.
        return Interrupted()
    except KilledWorker:
        # A task that waited behind another did not cause it.
        return WorkerDied() if flight.worker else Interrupted()
    except Exception as error:  # noqa: BLE001  (a worker without the package, a cluster of another version)
        log.error("cluster cannot run a task", reason=f"{type(error).__name__}: {error}")  # noqa: TRY400
        await asyncio.sleep(RETRY_SECONDS)
        return Interrupted()
    return outcome


def _drop_report(_task: Task, _outcome: Outcome, /) -> None:
    """Take reports after the end."""


Connect = Callable[[], AbstractAsyncContextManager[Client]]
"""Gives a client of the cluster for as long as a block lasts."""

CONNECT_SECONDS = 5.0
# A worker that dies takes its tasks with it, none is moved once it is somewhere, and a worker may have a
# process of its own. Tasks wait at workers, which measure for how long. deploy/dask.yaml has the same for
# clusters that operators run.
LOCAL = {
    "distributed.scheduler.allowed-failures": 0,
    "distributed.scheduler.work-stealing": False,
    "distributed.scheduler.worker-saturation": inf,
    "distributed.scheduler.worker-ttl": "30s",
    "distributed.worker.daemon": False,
    "distributed.worker.profile.enabled": False,
}


def connector(settings: Settings) -> Connect:
    """Say how to reach the cluster that the settings name, or start one where they name none."""
    # Its messages at every start and stop are not useful.
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
    # The scheduler is in this process and runs the code of all who connect, and all users of the machine
    # reach loopback. Only this process and its workers know the key of the certificate.
    security = Security.temporary()
    with dask.config.set(LOCAL):
        async with (
            LocalCluster(
                n_workers=workers,
                threads_per_worker=1,
                host="127.0.0.1",
                memory_limit=0,
                security=security,
                # Any free port: two services may be developed at once.
                dashboard_address="127.0.0.1:0",
                worker_dashboard_address="127.0.0.1:0",
                asynchronous=True,
            ) as cluster,
            Client(cluster, asynchronous=True, set_as_default=False) as client,
        ):
            yield client
