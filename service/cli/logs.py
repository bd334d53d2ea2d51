"""``penumbra logs``: what became of a job."""

from __future__ import annotations

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
    for entry in found.entries:
        at, event, message = _cells(entry)
        # Where only the order is known, the place of the time stays empty.
        padded = f"{at:<19}  {event:<15}  {message}"
        output.result(padded if output.on_terminal() else f"{at}\t{event}\t{message}")
    if found.more:
        output.say(f"{found.more} more tiles were repeated.")


def _cells(entry: LogEntry) -> tuple[str, str, str]:
    at = f"{entry.at.astimezone():%Y-%m-%d %H:%M:%S}" if entry.at else ""
    return at, entry.event, output.harmless(entry.message)
