"""``penumbra doctor --data``: verification of everything that a service has stored."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import typer

from service.cli import output
from service.cli.errors import CommandError, ExitCode
from service.cli.serve import read_settings

if TYPE_CHECKING:
    from service.jobs.verification import Verified
    from service.settings import Settings


def check_stored(place: str, database: str | None, config: Path | None, *, as_json: bool) -> None:
    """Verify all files and name those that are damaged; typer.Exit if one is."""
    from service.storage.folder import BUCKET

    given = {"store" if place.startswith(BUCKET) else "data": place, "database": database}
    settings = read_settings({name: value for name, value in given.items() if value}, config=config)
    if settings.database is None and not settings.sqlite_file.exists():
        raise CommandError(
            f"There is no database of a service in {settings.data}, and it has the checksums. Name another "
            "data folder, or give --database."
        )
    found = _verified(settings)
    lost = [file.name for file in found if not file.is_whole]
    lines = [
        *(f"{output.emphasis('damaged', 'red')} {name}" for name in lost),
        f"{len(found)} files in {settings.place}: "
        + (f"{len(lost)} damaged." if lost else "none is damaged."),
    ]
    document = {"place": settings.place, "files": len(found), "damaged": lost}
    output.report(document, lines, as_json=as_json)
    if lost:
        raise typer.Exit(ExitCode.BELOW_THRESHOLD)


def _verified(settings: Settings) -> list[Verified]:
    from service.jobs.verification import verify
    from service.storage.database.connection import Database
    from service.storage.database.migrations import SCRIPTS, is_current
    from service.storage.folder import place_of
    from service.storage.opening import OPENING_ERRORS, reason

    try:
        opened, place = Database(settings.database_url), place_of(settings.place)
        try:
            with opened.engine.connect() as connection:
                if not is_current(connection, SCRIPTS):
                    raise CommandError(
                        "The database is one of another version. Start the service once first."
                    )
            place.check()
            return list(verify(opened, place))
        finally:
            opened.close()
    except OPENING_ERRORS as error:
        raise CommandError(reason(error, settings.data)) from error
