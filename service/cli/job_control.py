"""Commands that change jobs: ``cancel``, ``delete``, ``pause``, ``resume``, ``pin``, ``unpin``, ``prune``."""

from __future__ import annotations

import re
from collections.abc import Mapping
from typing import TYPE_CHECKING, Annotated

import typer

from service.cli import output
from service.cli.connection import DEFAULT_SERVER, JobArgument, JobsArgument, ServerOption, connect
from service.cli.errors import CommandError, ExitCode
from service.cli.jobs import state_of

if TYPE_CHECKING:
    from schemas.jobs import Job
    from schemas.retention import Pruned

SECONDS = {"s": 1, "m": 60, "h": 3600, "d": 86400}
BYTES = {"": 1, "k": 10**3, "M": 10**6, "G": 10**9, "T": 10**12}
MOST_NAMED = 20
"""Jobs that are named on a terminal; --json names all."""

OlderOption = Annotated[
    str | None,
    typer.Option("--older-than", metavar="TIME", help="Pictures that succeeded so long ago: 90m, 12h, 7d."),
]
BytesOption = Annotated[
    str | None,
    typer.Option("--keep-bytes", metavar="SIZE", help="The oldest pictures beyond so many: 500M, 20G."),
]
AssetsOption = Annotated[
    str | None,
    typer.Option(
        "--assets-older-than", metavar="TIME", help="Textures that no picture needs, sent so long ago."
    ),
]
DryOption = Annotated[bool, typer.Option("--dry-run", help="Only report what would be deleted.")]


def cancel(
    job_id: JobArgument,
    server: ServerOption = DEFAULT_SERVER,
    as_json: output.JsonOption = False,
) -> None:
    """Stop a job, queued or running."""
    with connect(server) as client:
        _say_state(client.cancel(job_id), as_json=as_json)


def delete(
    job_ids: JobsArgument,
    server: ServerOption = DEFAULT_SERVER,
    as_json: output.JsonOption = False,
) -> None:
    """Remove jobs and their images; one that is queued or running is stopped first."""
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


def pause(
    job_id: JobArgument,
    server: ServerOption = DEFAULT_SERVER,
    as_json: output.JsonOption = False,
) -> None:
    """Pause a job: what is there stays, and no more of it is rendered until it is resumed."""
    with connect(server) as client:
        _say_state(client.pause(job_id), as_json=as_json)


def resume(
    job_id: JobArgument,
    server: ServerOption = DEFAULT_SERVER,
    as_json: output.JsonOption = False,
) -> None:
    """Resume a paused job."""
    with connect(server) as client:
        _say_state(client.resume(job_id), as_json=as_json)


def _say_state(job: Job, *, as_json: bool) -> None:
    if as_json:
        output.document(job.model_dump(mode="json"))
    else:
        output.say(f"Job {job.id}: {state_of(job)}")


def pin(
    job_id: JobArgument, server: ServerOption = DEFAULT_SERVER, as_json: output.JsonOption = False
) -> None:
    """Keep the picture of a job until it is unpinned or deleted; for its owner and staff."""
    with connect(server) as client:
        _say_kept(client.pin(job_id), as_json=as_json)


def unpin(
    job_id: JobArgument, server: ServerOption = DEFAULT_SERVER, as_json: output.JsonOption = False
) -> None:
    """Let the picture of a job expire like any other."""
    with connect(server) as client:
        _say_kept(client.unpin(job_id), as_json=as_json)


def prune(
    older_than: OlderOption = None,
    keep_bytes: BytesOption = None,
    assets_older_than: AssetsOption = None,
    dry_run: DryOption = False,
    server: ServerOption = DEFAULT_SERVER,
    as_json: output.JsonOption = False,
) -> None:
    """Have a service delete now what its rules, or those given, do not keep; pinned jobs stay. For admins."""
    seconds = None if older_than is None else amount(older_than, SECONDS, "7d")
    size = None if keep_bytes is None else int(amount(keep_bytes, BYTES, "20G"))
    assets = None if assets_older_than is None else amount(assets_older_than, SECONDS, "7d")
    with connect(server) as client:
        pruned = client.prune(
            keep_seconds=seconds, max_stored_bytes=size, keep_asset_seconds=assets, dry_run=dry_run
        )
    if as_json:
        output.document(pruned.model_dump(mode="json"))
    else:
        _say_pruned(pruned)


def amount(text: str, units: Mapping[str, int], example: str) -> float:
    """Read a number with its unit.

    Raises
    ------
    CommandError
        It is none, or has another unit.

    Examples
    --------
    >>> amount("1.5h", SECONDS, "7d"), amount("20G", BYTES, "20G")
    (5400.0, 20000000000.0)
    """
    found = re.fullmatch(r"(\d{1,12}(?:\.\d{1,6})?)([A-Za-z]?)", text.strip())
    if found is None or found[2] not in units:
        known = ", ".join(filter(None, units))
        raise CommandError(f"{text!r} is not an amount. Write it like {example}; units are {known}.")
    return float(found[1]) * units[found[2]]


def _say_kept(job: Job, *, as_json: bool) -> None:
    if as_json:
        output.document(job.model_dump(mode="json"))
    elif job.pinned:
        output.say(f"Job {job.id} is pinned: its picture stays.")
    else:
        until = f"until {job.expires_at.astimezone():%Y-%m-%d %H:%M}" if job.expires_at else "like any other"
        output.say(f"Job {job.id} is kept {until}.")


def _say_pruned(pruned: Pruned) -> None:
    for word, ids in (("expired", pruned.expired), ("forgotten", pruned.forgotten)):
        for job_id in ids[:MOST_NAMED]:
            output.result(f"{word}\t{job_id}")
        if len(ids) > MOST_NAMED:
            output.result(f"{word}\tand {len(ids) - MOST_NAMED} more")
    for sha256 in pruned.assets:
        output.result(f"asset\t{sha256}")
    would = "would leave the disk" if pruned.dry_run else "left the disk"
    more = " There is more." if pruned.more else ""
    output.say(
        f"{pruned.pictures} pictures and {len(pruned.assets)} textures or meshes {would}: "
        f"{pruned.bytes / 1e6:.1f} MB.{more}"
    )
