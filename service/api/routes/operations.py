"""Health checks of the service, and its version."""

from __future__ import annotations

import shutil
from importlib.metadata import version as installed

from fastapi import APIRouter
from pydantic import BaseModel
from sqlalchemy.exc import SQLAlchemyError

from schemas.jobs import Version
from service.api.routes.parameters import problem
from service.errors import StoreError, UnavailableError
from service.jobs.context import Here, Service

router = APIRouter(tags=["operations"])


class Condition(BaseModel):
    """The answer of a health check that passes."""

    status: str = "ok"


@router.get("/livez", responses=problem(503, "It needs to be started again."))
async def livez(here: Here) -> Condition:
    """Say whether the process can still do what it is for; if not, only starting it again helps."""
    # On the event loop: all threads may be waiting for a database that is away, and will go on with it.
    if not here.dispatcher.lives():
        raise UnavailableError("No work is handed out any more. Start the service again.")
    return Condition()


@router.get("/readyz", responses=problem(503, "What is missing is in `detail`."))
def readyz(here: Here) -> Condition:
    """Say whether jobs can be taken and rendered now."""
    missing = [what for what, passes in _checks(here).items() if not passes]
    if missing:
        raise UnavailableError(f"Not ready: {', '.join(missing)}.")
    return Condition()


def _checks(service: Service) -> dict[str, bool]:
    return {
        "the service is being stopped": not service.job_events.closed,
        "the database cannot be written": _database_writable(service),
        "no worker is running": service.dispatcher.alive(),
        "the disk is nearly full": _disk_free(service),
        _where(service): _store_usable(service),
    }


def _database_writable(service: Service) -> bool:
    try:
        service.database.check()
    except SQLAlchemyError:
        return False
    return True


def _where(service: Service) -> str:
    return (
        "the object store cannot be used" if service.settings.store else "the data folder cannot be written"
    )


def _store_usable(service: Service) -> bool:
    try:
        service.store.check()
    except (StoreError, OSError):
        return False
    return True


def _disk_free(service: Service) -> bool:
    return shutil.disk_usage(service.settings.data).free >= service.settings.min_free_bytes


@router.get("/version")
def version() -> Version:
    """Say which service this is."""
    return Version(version=installed("penumbra-render"))
