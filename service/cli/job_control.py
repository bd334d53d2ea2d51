"""Commands that change jobs: ``cancel``, ``delete``, ``pause``, ``resume``, ``pin``, ``unpin``, ``prune``."""

from __future__ import annotations

import re
from collections.abc import Callable, Mapping
from typing import TYPE_CHECKING, Annotated

import typer

from service.cli import output
from service.cli.errors import CommandError, ExitCode
from service.cli.jobs import state_of
from service.cli.options import DEFAULT_SERVER, JobArgument, JobsArgument, JsonOption, ServerOption, connect

if TYPE_CHECKING:
    from schemas.api.administration import Pruned
    from schemas.api.jobs import Job

SECONDS = {"s": 1, "m": 60, "h": 3600, "d": 86400}
BYTES = {"": 1, "k": 10**3, "M": 10**6, "G": 10**9, "T": 10**12}
MOST_NAMED = 20
"""Most jobs listed on a terminal; --json lists all."""


def _state(job: Job) -> str:
    return f"Job {job.id}: {state_of(job)}"


def _kept(job: Job) -> str:
    if job.pinned:
        return f"Job {job.id} is pinned: its picture is kept."
    until = (
        f"until {job.expires_at.astimezone():%Y-%m-%d %H:%M}" if job.expires_at else "as long as any other"
    )
    return f"Job {job.id} is kept {until}."


def _command(change: str, about: Callable[[Job], str], text: str) -> Callable[..., None]:
    """The command that makes one change to one job; `change` is the client's method."""

    def command(
        job_id: JobArgument, server: ServerOption = DEFAULT_SERVER, as_json: JsonOption = False
    ) -> None:
        with connect(server) as client:
            job = getattr(client, change)(job_id)
        if as_json:
            output.document(job)
        else:
            output.say(about(job))

    command.__doc__ = text
    return command


cancel = _command("cancel", _state, "Stop a job that is queued or running.")
pause = _command(
    "pause",
    _state,
    "Pause a job: no more tiles are rendered until it is resumed.\n\nFinished tiles are kept.",
)
resume = _command("resume", _state, "Resume a paused job.")
pin = _command(
    "pin", _kept, "Keep the picture of a job until it is unpinned or deleted.\n\nFor its owner and staff."
)
unpin = _command("unpin", _kept, "Let the picture of a job expire like any other.")


def delete(job_ids: JobsArgument, server: ServerOption = DEFAULT_SERVER, as_json: JsonOption = False) -> None:
    """Delete jobs and their pictures.

    A job that is queued or running is stopped first.
    """
    from service.client import NotFoundError

    deleted, missing = [], []
    with connect(server) as client:
        for job_id in dict.fromkeys(job_ids):
            try:
                client.delete(job_id)
                deleted.append(job_id)
            except NotFoundError:
                missing.append(job_id)
    if as_json:
        output.document({"deleted": deleted, "missing": missing})
    else:
        for job_id in deleted:
            output.say(f"Job {job_id} is deleted.")
        for job_id in missing:
            output.say(f"There is no job {job_id}.")
    if missing:
        raise typer.Exit(ExitCode.SERVER)


def prune(
    older_than: Annotated[
        str | None, typer.Option(metavar="TIME", help="Delete pictures older than this: 90m, 12h, 7d.")
    ] = None,
    keep_bytes: Annotated[
        str | None,
        typer.Option(metavar="SIZE", help="Delete the oldest pictures beyond this size: 500M, 20G."),
    ] = None,
    assets_older_than: Annotated[
        str | None,
        typer.Option(
            metavar="TIME",
            help="Delete assets that no picture needs, last uploaded or checked longer ago than this.",
        ),
    ] = None,
    dry_run: Annotated[bool, typer.Option("--dry-run", help="Only report what would be deleted.")] = False,
    server: ServerOption = DEFAULT_SERVER,
    as_json: JsonOption = False,
) -> None:
    """Delete what a service need not keep. For admins.

    Rules without an option are those of the service. Pinned jobs stay.
    """
    seconds = None if older_than is None else amount(older_than, SECONDS, "7d")
    size = None if keep_bytes is None else int(amount(keep_bytes, BYTES, "20G"))
    assets = None if assets_older_than is None else amount(assets_older_than, SECONDS, "7d")
    with connect(server) as client:
        pruned = client.prune(
            keep_seconds=seconds, max_stored_bytes=size, keep_asset_seconds=assets, dry_run=dry_run
        )
    if as_json:
        output.document(pruned)
    else:
        _say_pruned(pruned)


def amount(text: str, units: Mapping[str, int], example: str) -> float:
    """Read a number with its unit; CommandError if it is not a number, or has another unit.

    >>> amount("1.5h", SECONDS, "7d"), amount("20G", BYTES, "20G")
    (5400.0, 20000000000.0)
    """
    found = re.fullmatch(r"(\d{1,12}(?:\.\d{1,6})?)([A-Za-z]?)", text.strip())
    if found is None or found[2] not in units:
        known = ", ".join(filter(None, units))
        raise CommandError(f"{text!r} is not an amount. Write it like {example}; units are {known}.")
    return float(found[1]) * units[found[2]]


def _say_pruned(pruned: Pruned) -> None:
    for word, ids in (("expired", pruned.expired), ("forgotten", pruned.forgotten)):
        for job_id in ids[:MOST_NAMED]:
            output.result(f"{word}\t{job_id}")
        if len(ids) > MOST_NAMED:
            output.result(f"{word}\tand {len(ids) - MOST_NAMED} more")
    for sha256 in pruned.assets:
        output.result(f"asset\t{sha256}")
    would = "would be deleted" if pruned.dry_run else "were deleted"
    more = " There is more." if pruned.more else ""
    output.say(
        f"{pruned.pictures} pictures and {len(pruned.assets)} textures or meshes {would}: "
        f"{pruned.bytes / 1e6:.1f} MB.{more}"
    )
