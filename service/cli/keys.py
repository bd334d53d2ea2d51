"""``penumbra keys``: the API keys of a service, in its database."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Literal

import typer

from service.cli import output
from service.cli.errors import CommandError, ExitCode
from service.cli.help_pages import Command, Group
from service.cli.options import DatabaseOption, DataOption, JsonOption
from service.cli.serve import read_settings

if TYPE_CHECKING:
    from sqlalchemy.orm import Session

    from service.settings import Settings
    from service.storage.database.models import KeyRow

# Repeated so that `penumbra --help` need not load the schemas; the database takes no other.
RoleName = Literal["submit", "staff", "admin"]
# The length of the database column, and the range of another.
LONGEST_NAME, MOST_JOBS = 64, 2**31 - 1
# As of the settings that a key replaces.
MOST_CPU_SECONDS = 1e12

app = typer.Typer(
    cls=Group,
    help="Create, list and revoke API keys: who may use a service.",
    context_settings={"help_option_names": ["-h", "--help"]},
)


@app.callback(invoke_without_command=True)
def _without_a_command(context: typer.Context) -> None:
    if context.invoked_subcommand is None:
        typer.echo(context.get_help())
        raise typer.Exit(ExitCode.USAGE)


@app.command(cls=Command)
def add(
    user: Annotated[str, typer.Argument(metavar="USER", help="Name of the user.", show_default=False)],
    role: Annotated[
        RoleName,
        typer.Option(
            help="`submit` sees its own jobs, `staff` all jobs; `admin` may also stop and delete them."
        ),
    ] = "submit",
    max_jobs: Annotated[
        int | None,
        typer.Option(min=1, max=MOST_JOBS, help="Most jobs of the user that may be queued or running."),
    ] = None,
    max_cpu_seconds: Annotated[
        float | None,
        typer.Option(
            min=0.001,
            max=MOST_CPU_SECONDS,
            help="Most predicted CPU seconds of the user's queued and running jobs.",
        ),
    ] = None,
    first: Annotated[
        bool,
        typer.Option(
            "--first", help="Do nothing if there is a key already: for scripts that start a service."
        ),
    ] = False,
    data: DataOption = None,
    database: DatabaseOption = None,
    as_json: JsonOption = False,
) -> None:
    """Create a key for a user and print it. It cannot be shown again."""
    from schemas.api.administration import Role
    from service.access import keys

    if not 0 < len(user) <= LONGEST_NAME or not user.isprintable():
        raise CommandError(f"The name of a user has 1 to {LONGEST_NAME} printable characters.")
    settings = _settings(data, database)
    with _writing(settings) as session:
        if first and keys.any_made(session):
            output.say("There is a key already: none was created.")
            return
        key = keys.add(session, user, Role(role), max_jobs=max_jobs, max_cpu_seconds=max_cpu_seconds)
    if as_json:
        output.document({"id": key.id, "user": user, "role": role, "key": str(key)})
        return
    output.result(str(key))
    place = "the configured database" if settings.database else f"the data folder {settings.data}"
    output.say(f"Key {key.id} of {user} is in {place}. It cannot be shown again: only its hash is stored.")


@app.command(cls=Command)
def ls(data: DataOption = None, database: DatabaseOption = None, as_json: JsonOption = False) -> None:
    """List the keys. Their secrets are not stored."""
    from service.access import keys

    with _writing(_existing(data, database)) as session:
        rows = [_document(row) for row in keys.listing(session)]
    lines = ("\t".join(str(cell or "") for cell in row.values()) for row in rows)
    output.report({"keys": rows}, lines, as_json=as_json)


@app.command(cls=Command)
def revoke(
    key_id: Annotated[
        str,
        typer.Argument(
            metavar="ID", help="The key's id, as `penumbra keys ls` shows it.", show_default=False
        ),
    ],
    data: DataOption = None,
    database: DatabaseOption = None,
) -> None:
    """Revoke a key at once. The user's jobs stay."""
    from service.access import keys

    with _writing(_existing(data, database)) as session:
        if not keys.revoke(session, key_id):
            raise CommandError(f"There is no key {output.harmless(key_id)!r}. `penumbra keys ls` lists them.")
    output.say(f"Key {key_id} is revoked.")


def _settings(data: Path | None, database: str | None) -> Settings:
    given = {"data": data, "database": database}
    return read_settings({name: value for name, value in given.items() if value is not None})


def _existing(data: Path | None, database: str | None) -> Settings:
    """Settings of a service that has been used: a misspelt folder must not become an empty one."""
    settings = _settings(data, database)
    if settings.database is None and not settings.sqlite_file.exists():
        raise CommandError(
            f"There is no database of a service in {settings.data}. Give its --data or --database."
        )
    return settings


@contextmanager
def _writing(settings: Settings) -> Iterator[Session]:
    """Open the database of a service, which may be running."""
    from service.storage.database.connection import Database
    from service.storage.database.migrations import upgrade
    from service.storage.opening import OPENING_ERRORS, reason

    try:
        settings.data.mkdir(mode=0o700, parents=True, exist_ok=True)
        opened = Database(settings.database_url)
        try:
            upgrade(opened)
            with opened.writing() as session:
                yield session
        finally:
            opened.close()
    except OPENING_ERRORS as error:
        raise CommandError(reason(error, settings.data)) from error


def _document(row: KeyRow) -> dict[str, object]:
    return {
        "id": row.id,
        "user": row.user,
        "role": row.role,
        "max_jobs": row.max_jobs,
        "max_cpu_seconds": row.max_cpu_seconds,
        "created_at": row.created_at.isoformat(timespec="seconds"),
        "revoked_at": row.revoked_at.isoformat(timespec="seconds") if row.revoked_at else None,
    }
