"""Which engine a service has."""

from __future__ import annotations

from service.errors import EngineError, EngineMissingError
from service.settings import Settings
from service.workers.protocol import Engine
from service.workers.slots import SlotEngine
from service.workers.worker import WorkerSetup


def check_engine(settings: Settings) -> None:
    """Refuse an engine that is not installed, or that strangers could give orders to.

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
        from service.workers.dask_address import check_address  # noqa: PLC0415

        check_address(settings)


def engine_of(settings: Settings, setup: WorkerSetup) -> Engine:
    """Give the engine that the settings ask for."""
    if settings.engine == "slots":
        return SlotEngine(settings.workers, setup)
    from service.workers.dask_cluster import connector  # noqa: PLC0415  (an extra)
    from service.workers.dask_engine import DaskEngine  # noqa: PLC0415

    return DaskEngine(connector(settings), setup)
