"""``penumbra logs``: what became of a job."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from typing import TYPE_CHECKING

from service.cli import output
from service.cli.connection import DEFAULT_SERVER, JobArgument, ServerOption, connect

if TYPE_CHECKING:
    from schemas.logs import LogEntry


def logs(
    job_id: JobArgument,
    server: ServerOption = DEFAULT_SERVER,
    as_json: output.JsonOption = False,
) -> None:
    """Show what became of a job: states, passes, repeated tiles, workers lost, failures."""
    with connect(server) as client:
        found = client.log(job_id)
    if as_json:
        output.document(found.model_dump(mode="json"))
        return
    for line in (_seen if output.on_terminal() else _piped)(found.entries):
        output.result(line)
    if found.more:
        output.say(f"{found.more} more tiles were repeated.")


def _piped(entries: Iterable[LogEntry]) -> Iterator[str]:
    """Time, word and sentence with tabs between them; no time where only the order is known."""
    for entry in entries:
        at = f"{entry.at.astimezone():%Y-%m-%d %H:%M:%S}" if entry.at else ""
        yield f"{at}\t{entry.event}\t{output.harmless(entry.message)}"


def _seen(entries: Iterable[LogEntry]) -> Iterator[str]:
    """Times and sentences under the days to which they belong: a terminal may have only 80 columns."""
    day = None
    for entry in entries:
        at = entry.at.astimezone() if entry.at else None
        if at is not None and at.date() != day:
            day = at.date()
            yield f"{day}"
        yield f"  {f'{at:%H:%M:%S}' if at else '':<8}  {output.harmless(entry.message)}"
