"""``penumbra keys``: the API keys of a service, in its database."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Literal

import typer

from service.cli import output
from service.cli.errors import CommandError, ExitCode, UnusableSceneError
from service.cli.help_pages import Command, Group
from service.cli.options import DatabaseOption, DataOption, JsonOption
from service.cli.serve import read_settings

if TYPE_CHECKING:
    from sqlalchemy.orm import Session

    from schemas.api.administration import KeyRequest
    from service.access.keys import Key
    from service.settings import Settings
    from service.storage.database.models import KeyRow

# Repeated so that `penumbra --help` need not load the schemas; the database takes no other.
RoleName = Literal["submit", "staff", "admin"]
# As in the schemas.
MOST_JOBS, MOST_CPU_SECONDS = 2**31 - 1, 1e12

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


UserArgument = Annotated[str, typer.Argument(metavar="USER", help="Name of the user.", show_default=False)]
RoleOption = Annotated[
    RoleName,
    typer.Option(help="`submit` sees its own jobs, `staff` all jobs; `admin` may also stop and delete them."),
]
MaxJobsOption = Annotated[
    int | None,
    typer.Option(min=1, max=MOST_JOBS, help="Most jobs of the user that may be queued or running."),
]
MaxCpuSecondsOption = Annotated[
    float | None,
    typer.Option(
        min=0.001,
        max=MOST_CPU_SECONDS,
        help="Most predicted CPU seconds of the user's queued and running jobs.",
    ),
]
ExpiresOption = Annotated[
    str | None,
    typer.Option(
        metavar="DATE",
        help="When the key ends: 2030-01-31 (0:00 UTC), or 2030-01-31T18:00+01:00; by default never.",
    ),
]
FirstOption = Annotated[
    bool,
    typer.Option("--first", help="Do nothing if there is a key already: for scripts that start a service."),
]
OutOption = Annotated[
    Path | None,
    typer.Option(
        "-o",
        "--out",
        metavar="FILE",
        help="Write the key to this file, which only its owner may read, and print nothing: what a "
        "container prints is in its log.",
    ),
]


@app.command(cls=Command)
def add(  # noqa: PLR0913, PLR0917 - one argument for each option
    user: UserArgument,
    role: RoleOption = "submit",
    max_jobs: MaxJobsOption = None,
    max_cpu_seconds: MaxCpuSecondsOption = None,
    expires: ExpiresOption = None,
    first: FirstOption = False,
    out: OutOption = None,
    data: DataOption = None,
    database: DatabaseOption = None,
    as_json: JsonOption = False,
) -> None:
    """Create a key for a user and print it. It cannot be shown again."""
    from service.access import keys

    asked = _request(
        user=user, role=role, max_jobs=max_jobs, max_cpu_seconds=max_cpu_seconds, expires_at=expires
    )
    settings = _settings(data, database)
    with _writing(settings) as session:
        if first and keys.any_made(session):
            output.say("There is a key already: none was created.")
            return
        key = keys.add(session, **dict(asked))
        if out is not None:
            # Before the key is kept: it could not be shown again.
            _write_secret(out, f"{key}\n")
    if out is None:
        _print_key(key, asked, settings, as_json=as_json)
    else:
        output.say(f"Key {key.id} of {user} is in {output.harmless(str(out))}.")


@app.command(cls=Command)
def roster(
    file: Annotated[
        Path,
        typer.Argument(
            metavar="FILE.csv",
            help="Its first line names the columns: user, and if needed role, max_jobs, max_cpu_seconds and "
            "expires_at.",
            exists=True,
            dir_okay=False,
            show_default=False,
        ),
    ],
    data: DataOption = None,
    database: DatabaseOption = None,
    as_json: JsonOption = False,
) -> None:
    """Create a key for each user of a roster who has no valid one, and print all as CSV.

    New keys cannot be shown again; of users who had a key the column `key` is empty.
    """
    from schemas.errors import SceneError
    from service.access import roster as rosters

    content = file.read_bytes()
    try:
        asked = rosters.read(content)
    except SceneError as error:
        raise UnusableSceneError(str(file), content, error.errors, error.more) from error
    with _writing(_settings(data, database)) as session:
        enrolments = rosters.enrol(session, asked)
    if as_json:
        output.document({"keys": [each._asdict() for each in enrolments]})
        return
    output.result(rosters.write(enrolments).rstrip())
    made = sum(bool(each.key) for each in enrolments)
    output.say(f"{made} of {len(enrolments)} keys are new. They cannot be shown again.")


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


def _print_key(key: Key, asked: KeyRequest, settings: Settings, *, as_json: bool) -> None:
    if as_json:
        output.document({"id": key.id, "user": asked.user, "role": asked.role, "key": str(key)})
        return
    output.result(str(key))
    place = "the configured database" if settings.database else f"the data folder {settings.data}"
    output.say(
        f"Key {key.id} of {asked.user} is in {place}. It cannot be shown again: only its hash is stored."
    )


def _write_secret(path: Path, text: str) -> None:
    """Write a file that only its owner may read, whole or not at all."""
    from service.errors import StoreError
    from service.storage.folder import Folder

    try:
        Folder(path.absolute().parent).put(path.name, text.encode())
    except (StoreError, OSError) as error:
        cure = "Its folder must exist, be writable and have room."
        raise CommandError(f"{output.harmless(str(path))} cannot be written. {cure}") from error


def _request(**fields: object) -> KeyRequest:
    from schemas.api.administration import KeyRequest
    from schemas.errors import SceneError
    from schemas.reading import read_document

    try:
        return read_document(fields, KeyRequest)[0]
    except SceneError as error:
        wrong = (f"{problem.pointer.removeprefix('/')}: {problem.detail}" for problem in error.errors)
        raise CommandError(" ".join(wrong)) from error


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
    shown = {
        "id": row.id,
        "user": row.user,
        "role": row.role,
        "max_jobs": row.max_jobs,
        "max_cpu_seconds": row.max_cpu_seconds,
    }
    times = {name: getattr(row, name) for name in ("created_at", "expires_at", "last_used_at", "revoked_at")}
    return shown | {name: at and at.isoformat(timespec="seconds") for name, at in times.items()}
