"""An engine with one worker, a store with one job, and what was reported."""

import hashlib
import queue
import resource
from collections.abc import Callable, Sequence
from contextlib import suppress
from pathlib import Path
from typing import Any

import psutil

import renderer
from renderer import tiling
from schemas.api.jobs import JobRequest
from schemas.limits import Limits
from service.settings import Settings
from service.storage.folder import Folder
from service.storage.tiles import TileStore
from service.workers.engines import engine_of
from service.workers.heartbeats import Lease
from service.workers.tasks import Outcome, Task, TileTask
from service.workers.worker import WorkerSetup
from tests.service.support import TIMEOUT, scene, until


class Bench:
    """Gives tasks to an engine; those of its job are tiles of a picture.

    Parameters
    ----------
    folder
        Where pictures are stored, by several engines if it is given to several.
    document
        The scene of the job; by default one whose tiles take a moment.
    """

    def __init__(
        self,
        folder: Path,
        document: dict[str, Any] | None = None,
        *,
        kind: str = "slots",
        layers: Sequence[str] = (),
        memory_bytes: int = 4 << 30,
        lease: Lease | None = None,
    ) -> None:
        self._kind = kind
        self.store = TileStore(Folder(folder / "jobs"))
        Folder(folder).begin("assets")
        setup = WorkerSetup(str(folder), Limits(), memory_bytes, lease or Lease(slice_seconds=TIMEOUT))
        self.engine = engine_of(Settings.model_validate({"engine": kind, "workers": 1}), setup)
        self.reports: queue.Queue[tuple[Task, Outcome]] = queue.Queue()
        document = document or scene(128, 64, samples=256, light_samples=64)
        request = JobRequest.model_validate({"scene": document, "layers": list(layers)})
        self.plan = renderer.compile_scene(request.scene, layers=layers)
        spec = request.model_dump_json(exclude_none=True).encode()
        self.spec_sha256 = hashlib.sha256(spec).hexdigest()
        self.store.put_spec("job", spec)
        # Servers of other tests, whose workers are not those of this engine.
        self._others = set(psutil.Process().children())
        self.engine.start(lambda task, outcome: self.reports.put((task, outcome)))
        until(self.engine.alive, TIMEOUT)

    def tile(self, number: int = 0) -> TileTask:
        pass_ = self.plan.passes[-1]
        return TileTask("job", self.spec_sha256, tiling.tiles(self.plan, pass_, 64)[number], pass_, attempt=1)

    def submit(self, *tasks: Task) -> None:
        for task in tasks:
            self.engine.submit(task)

    def collect(self, count: int) -> dict[Task, Outcome]:
        return dict(self.reports.get(timeout=TIMEOUT) for _ in range(count))

    def run(self, task: Task) -> Outcome:
        self.submit(task)
        return self.collect(1)[task]

    def workers(self) -> set[int]:
        """Processes that render; other engines of this process have theirs."""
        if self._kind == "slots":
            return {slot.pid for slot in self.engine._slots if slot.pid is not None}  # noqa: SLF001
        own = set(psutil.Process().children()) - self._others
        return {process for child in own for process in _family(child) if _renders(process)}

    def worker(self) -> int:
        until(lambda: self.engine.alive() and len(self.workers()) == 1, TIMEOUT)
        (found,) = self.workers()
        return found

    def is_replaced(self, worker: int) -> bool:
        return self.engine.alive() and bool(self.workers()) and worker not in self.workers()

    def working(self, worker: int) -> Callable[[], bool]:
        """Whether a worker has used the processor since this call."""
        before = _cpu_seconds(worker)
        return lambda: _cpu_seconds(worker) > before


def _family(process: psutil.Process) -> list[int]:
    """A process and all that come from it, as long as it runs."""
    with suppress(psutil.NoSuchProcess):
        return [process.pid, *(child.pid for child in process.children(recursive=True))]
    return []


def _renders(process: int) -> bool:
    """Whether the address space of a process is limited, as only a worker's is."""
    # A process of another user, such as PostgreSQL's, does not tell.
    with suppress(ProcessLookupError, PermissionError):
        return resource.prlimit(process, resource.RLIMIT_AS)[0] != resource.RLIM_INFINITY
    return False


def _cpu_seconds(process: int) -> float:
    return psutil.Process(process).cpu_times().user
