"""Code inside each worker of a Dask cluster: one slot, as on a single machine."""

from __future__ import annotations

import threading
import time
from concurrent.futures import Future
from importlib.metadata import version
from multiprocessing import current_process

from distributed import Worker, WorkerPlugin, get_worker

from service.errors import StoreError, UnusableWorkerError
from service.storage.folder import ASSETS, place_of
from service.workers.slots import SlotEngine
from service.workers.tasks import Interrupted, Outcome, Task, after
from service.workers.worker import WorkerSetup

PLUGIN_NAME = "penumbra"
BEGUN_TOPIC = "penumbra-begun"
"""The topic under which a worker reports that a task has begun."""

# States of a task, as Dask names them, after which a worker forgets it.
ENDED_STATES = {"released", "forgotten", "memory", "error"}
# How often `stop` looks for the running task, seconds.
LOOK_SECONDS = 0.05


class SlotPlugin(WorkerPlugin):
    """A slot in a Dask worker: a task that kills its process leaves the worker alive.

    Parameters
    ----------
    setup : WorkerSetup
        Settings of the slot's process.
    """

    name = PLUGIN_NAME

    def __init__(self, setup: WorkerSetup) -> None:
        self._setup = setup
        self._version = version("penumbra-render")

    def setup(self, worker: Worker) -> None:
        """Start the process of the slot, or end a worker that could not render.

        Raises
        ------
        UnusableWorkerError
            If something is missing here; the message says what.
        """
        self._worker = worker
        self._lock = threading.Lock()
        self._unwanted = threading.Event()
        self._key: str | None = None
        self._came: dict[str, float] = {}
        self._ending: Future[Outcome] = Future()
        self._slot: SlotEngine | None = None
        try:
            self._check(worker)
        except UnusableWorkerError as error:
            worker.loop.add_callback(worker.close, reason=str(error))
            raise
        self._slot = SlotEngine(1, self._setup)
        self._slot.start(self._ended)

    def teardown(self, worker: Worker) -> None:  # noqa: ARG002  (an interface)
        """Kill the process of the slot; a task that runs ends as interrupted."""
        slot, self._slot = self._slot, None
        if slot is not None:
            slot.close()
            self._end(Interrupted())

    def transition(self, key: str, start: str, finish: str, **_: object) -> None:
        """Note when a task comes; stop one that was cancelled, or whose client is gone."""
        if finish in ENDED_STATES:
            self._came.pop(key, None)
        else:
            self._came.setdefault(key, time.monotonic())
        if start == "executing" and finish == "released":
            self.stop(key)

    def run(self, key: str, task: Task) -> Outcome:
        """Execute a task in the slot."""
        slot = self._slot
        assert slot is not None
        self._begin(key)
        self._worker.log_event(BEGUN_TOPIC, {"key": key, "worker": self._worker.address})
        # Time limits include the wait behind other tasks of this worker.
        slot.submit(after(task, time.monotonic() - self._came.get(key, time.monotonic())))
        return self._outcome(slot)

    def stop(self, key: str | None) -> None:
        """Kill the process if it runs this task, or any if no key is given."""
        with self._lock:
            if key in (None, self._key):
                self._unwanted.set()

    def _begin(self, key: str) -> None:
        with self._lock:
            self._key, self._ending = key, Future()
            self._unwanted.clear()

    def _outcome(self, slot: SlotEngine) -> Outcome:
        while True:
            try:
                return self._ending.result(LOOK_SECONDS)
            except TimeoutError:
                # Repeatedly, because a process that is still starting cannot be interrupted yet.
                if self._unwanted.is_set():
                    slot.interrupt(lambda _: True)

    def _ended(self, _task: Task, outcome: Outcome, /) -> None:
        self._end(outcome)

    def _end(self, outcome: Outcome) -> None:
        with self._lock:
            self._key = None
            if not self._ending.done():
                self._ending.set_result(outcome)

    def _check(self, worker: Worker) -> None:
        here = version("penumbra-render")
        if here != self._version:
            raise UnusableWorkerError(
                f"This worker has Penumbra {here}, the service {self._version}. Install the same on both."
            )
        if worker.state.nthreads != 1:
            raise UnusableWorkerError("A worker is one slot. Start it with --nthreads 1.")
        if current_process().daemon:
            raise UnusableWorkerError(
                "This worker may not start the process that renders. "
                "Set DASK_DISTRIBUTED__WORKER__DAEMON=False for it, or start it with --no-nanny."
            )
        try:
            place_of(self._setup.store).within(ASSETS).check()
        except StoreError as error:
            raise UnusableWorkerError(f"This worker does not see the pictures. {error}") from error


def execute(key: str, task: Task) -> Outcome:
    """Execute a task in the slot of the Dask worker that calls this."""
    worker: Worker = get_worker()
    if PLUGIN_NAME not in worker.plugins:
        # It has just joined, and gets its slot in a moment.
        time.sleep(LOOK_SECONDS)
        return Interrupted()
    return _slot(worker).run(key, task)


def stop(key: str | None, dask_worker: Worker) -> None:
    """Stop a task that runs in a worker, or any task if no key is given."""
    _slot(dask_worker).stop(key)


def _slot(worker: Worker) -> SlotPlugin:
    plugin = worker.plugins[PLUGIN_NAME]
    assert isinstance(plugin, SlotPlugin)
    return plugin
