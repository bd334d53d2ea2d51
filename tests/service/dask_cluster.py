"""A Dask cluster of separate processes on this machine, with the configuration for operators."""

import os
import socket
import subprocess
import sys
from pathlib import Path

from tests.service.processes import workers_of
from tests.service.support import TIMEOUT, until

CONFIGURATION = Path(__file__).parents[2] / "deploy" / "dask.yaml"


class Cluster:
    """A scheduler on a port that stays the same, and workers.

    Parameters
    ----------
    options : str
        Further arguments of scheduler and workers, about certificates.
    scheme : str
        Of its address.
    """

    def __init__(self, *options: str, scheme: str = "tcp") -> None:
        with socket.create_server(("127.0.0.1", 0)) as probe:
            self._port = probe.getsockname()[1]
        self._options = options
        self._scheme = scheme
        self.address = f"{scheme}://127.0.0.1:{self._port}"
        self.workers: list[subprocess.Popen[bytes]] = []
        self.scheduler = self._start_scheduler()

    def start_worker(self, **environment: str) -> None:
        options = ["--nthreads", "1", "--no-nanny", "--memory-limit", "0", "--no-dashboard", *self._options]
        self.workers.append(_dask("worker", self.address, *options, **environment))

    def wait_for_workers(self) -> None:
        """Wait until each has its slot."""
        until(lambda: all(workers_of(worker.pid) for worker in self.workers), TIMEOUT)

    def restart(self) -> None:
        """Start all of it again, as its supervisors do."""
        self.scheduler = self._start_scheduler()
        for _ in range(len(self.workers)):
            self.workers.pop(0)
            self.start_worker()

    def close(self) -> None:
        for process in (*self.workers, self.scheduler):
            process.kill()
            process.wait()

    def _start_scheduler(self) -> subprocess.Popen[bytes]:
        place = ["--host", "127.0.0.1", "--port", str(self._port), "--dashboard-address", "127.0.0.1:0"]
        return _dask("scheduler", "--protocol", self._scheme, *place, *self._options)


def _dask(*arguments: str, **more: str) -> subprocess.Popen[bytes]:
    environment = os.environ | {"DASK_CONFIG": str(CONFIGURATION), "DASK_LOGGING__DISTRIBUTED": "error"}
    return subprocess.Popen([sys.executable, "-m", "dask", *arguments], env=environment | more)
