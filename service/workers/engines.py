"""Engines: their interface, the choice of one for a service, and which Dask clusters are safe."""

from __future__ import annotations

from collections.abc import Callable
from importlib.util import find_spec
from typing import Protocol
from urllib.parse import urlsplit

from service.access.hosts import is_loopback
from service.errors import EngineError, EngineMissingError, UnsafeClusterError
from service.settings import Settings
from service.workers.slots import SlotEngine
from service.workers.states import WorkerState
from service.workers.tasks import Report, Task
from service.workers.worker import WorkerSetup


class Engine(Protocol):
    """Executes tasks somewhere else. All methods are called by one thread, the dispatcher's."""

    def start(self, report: Report) -> None:
        """Get ready; ``report`` receives the outcome of every task."""

    def room(self) -> int:
        """Number of tasks that can be submitted now without a long wait."""

    def idle(self) -> int:
        """Number of tasks that would begin at once if submitted now."""

    def spare(self) -> int:
        """Number of tasks of idle users that begin at once, as all others are overdue."""

    def submit(self, task: Task, *, spare: bool = False) -> None:
        """Execute a task, beside overdue ones if it may. The outcome is reported, never returned."""

    def interrupt(self, wanted: Callable[[Task], bool]) -> None:
        """Stop the running tasks that are ``wanted``; they are reported as interrupted."""

    def workers(self) -> list[WorkerState]:
        """States of all workers. May be called by any thread."""

    def alive(self) -> bool:
        """Whether a task submitted now would be executed. May be called by any thread."""

    def close(self) -> None:
        """Stop everything at once. Nothing is reported afterwards."""


def check_engine(settings: Settings, *, keys_made: bool = False) -> None:
    """Refuse an engine that is not installed, or that anyone on the network could give orders to.

    Parameters
    ----------
    keys_made
        Whether the service requires keys: then users of the machine are not trusted either.

    Raises
    ------
    EngineError
        If a cluster is named that the engine would not use.
    EngineMissingError
        If the extra of the engine is not installed.
    UnsafeClusterError
        If the cluster that is named cannot be used safely.
    """
    if settings.engine == "slots":
        if settings.dask is not None:
            raise EngineError(f"The cluster {settings.dask} would not be used. Give --engine dask as well.")
    else:
        try:
            import distributed  # noqa: F401, PLC0415  (an extra, which most services do without)
        except ImportError:
            raise EngineMissingError from None
        if settings.dask is None and find_spec("cryptography") is None:
            raise EngineMissingError
        check_address(settings, keys_made=keys_made)


def engine_of(settings: Settings, setup: WorkerSetup) -> Engine:
    """Return the configured engine."""
    if settings.engine == "slots":
        return SlotEngine(settings.workers, setup)
    from service.workers.dask_engine import DaskEngine, connector  # noqa: PLC0415  (an extra)

    return DaskEngine(connector(settings), setup)


def check_address(settings: Settings, *, keys_made: bool = False) -> None:
    """Refuse a cluster that anyone on the network could give orders to.

    Parameters
    ----------
    keys_made
        As in `check_engine`.

    Raises
    ------
    UnsafeClusterError
        If the address is not one of a scheduler, or is another machine's and connections to it would not be
        encrypted, or where keys are required; the message says what to do.
    """
    if settings.dask is None:
        return
    parts = urlsplit(settings.dask)
    if parts.scheme not in ("tcp", "tls") or not parts.hostname:
        raise UnsafeClusterError(
            f"{settings.dask} is not the address of a Dask scheduler. Write it like tls://host:8786."
        )
    if parts.scheme == "tls":
        _check_certificates(settings)
    elif settings.dask_trusted_network:
        return
    elif not is_loopback(parts.hostname):
        raise UnsafeClusterError(
            f"{settings.dask} is on another machine, and tcp:// is not encrypted: anyone who reaches it "
            "runs code on every worker. Start the cluster with certificates and write "
            f"tls://{parts.netloc}, with the settings dask_tls_ca, dask_tls_cert and dask_tls_key. "
            "If the network itself is encrypted and closed to others, set dask_trusted_network."
        )
    elif keys_made:
        raise UnsafeClusterError(
            f"This service requires keys, but {settings.dask} does not: every user of this machine runs "
            "code on its workers. Start the cluster with certificates, which deploy/certificates.sh makes, "
            f"and write tls://{parts.netloc}, with the settings dask_tls_ca, dask_tls_cert and dask_tls_key. "
            "If all users of this machine are trusted, set dask_trusted_network."
        )


def _check_certificates(settings: Settings) -> None:
    files = {name: getattr(settings, name) for name in ("dask_tls_ca", "dask_tls_cert", "dask_tls_key")}
    missing = [name for name, path in files.items() if path is None]
    if missing:
        raise UnsafeClusterError(f"A tls:// address needs certificates. Set {', '.join(missing)} as well.")
    unreadable = [str(path) for path in files.values() if not path.is_file()]
    if unreadable:
        raise UnsafeClusterError(f"There is no file {', '.join(unreadable)}, which the settings name.")
