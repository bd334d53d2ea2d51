"""``penumbra get``, ``ls`` and ``logs``: the jobs of a service, their images and histories."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from service.cli import output
from service.cli.errors import CommandError
from service.cli.options import (
    DEFAULT_SERVER,
    JobArgument,
    JsonOption,
    LayersOption,
    ServerOption,
    State,
    connect,
    image_option,
    listed_labels,
)
from service.cli.targets import ImageTarget, check_target, parsed_layers, save, save_layer
from service.cli.wording import counted

if TYPE_CHECKING:
    from schemas.api.jobs import Job, JobList, LogEntry
    from service.client import Client

CURVE_FORMS = (".json", ".csv", ".svg", ".png")
"""Endings of the files that a curve can be saved as."""

HEADINGS = ("id", "state", "done", "pixels", "submitted", "scene")


def get(
    job_id: JobArgument,
    out: Annotated[ImageTarget | None, image_option("Save the picture")] = None,
    layers: LayersOption = None,
    convergence: Annotated[
        Path | None,
        typer.Option(
            metavar="FILE",
            help="Save the error and the cost after each pass: .json, .csv, or a plot as .svg or .png.",
        ),
    ] = None,
    server: ServerOption = DEFAULT_SERVER,
    as_json: JsonOption = False,
) -> None:
    """Show a job, or save its picture or its error against time.

    If the job is not finished, they are as far as it has come.
    """
    names = parsed_layers(layers)
    if names and out is None:
        raise CommandError("--layers are saved beside the picture. Give -o too.")
    if out is not None:
        out.check(names, as_json=as_json)
    if convergence is not None:
        check_target(convergence, CURVE_FORMS)
    with connect(server) as client:
        if names:
            _check_layers(client.get(job_id), names)
        if out is not None:
            save_picture(client, job_id, out, names)
        if convergence is not None:
            form = convergence.suffix.lower().removeprefix(".")
            content = client.convergence_file(job_id, form)
            save(convergence, content, f"the error of {job_id} against time")
        job = client.get(job_id)
    if as_json:
        output.document(job)
    elif out is None and convergence is None:
        _show(job)


def _check_layers(job: Job, names: Iterable[str]) -> None:
    """Raise CommandError, before anything is written, where a job was not submitted with these layers."""
    missing = [name for name in names if name not in job.links.layers]
    if missing:
        there = ", ".join(job.links.layers) or "none"
        raise CommandError(
            f"--layers: Job {job.id} has no layer {' or '.join(missing)}. It was submitted "
            f"with these layers: {there}."
        )


def ls(
    limit: Annotated[int, typer.Option(min=1, help="Maximum number of jobs, newest first.")] = 20,
    after: Annotated[
        str | None, typer.Option(metavar="CURSOR", help="Continue the list that ended with this cursor.")
    ] = None,
    state: Annotated[State | None, typer.Option(help="Only jobs in this state.")] = None,
    label: Annotated[
        list[str] | None,
        typer.Option(
            metavar="NAME:VALUE", help="Only jobs with this label; of a name with several values, any."
        ),
    ] = None,
    search: Annotated[
        str | None, typer.Option(metavar="TEXT", help="Only jobs with this text in their name or a label.")
    ] = None,
    server: ServerOption = DEFAULT_SERVER,
    as_json: JsonOption = False,
) -> None:
    """List the jobs of a service, newest first."""
    wanted = listed_labels(label)
    from service.client import RequestInvalidError

    try:
        with connect(server) as client:
            page = _listed(client, limit, after, {"state": state, "labels": wanted, "search": search})
    except RequestInvalidError as error:
        raise CommandError(error.document.detail or str(error)) from error
    rows = [_cells(job) for job in page.jobs]
    if output.on_terminal() and not as_json:
        output.show(output.table(HEADINGS, rows))
    else:
        output.report(page, map("\t".join, rows), as_json=as_json)
    if page.next is not None and not as_json:
        output.say(f"There are more: --after {page.next}")


def _listed(client: Client, limit: int, cursor: str | None, filters: dict[str, Any]) -> JobList:
    """The first `limit` jobs; a service gives at most `LONGEST_PAGE` at once."""
    from service.client.calls import LONGEST_PAGE

    page = client.list(limit=min(limit, LONGEST_PAGE), cursor=cursor, **filters)
    while page.next is not None and len(page.jobs) < limit:
        left = min(limit - len(page.jobs), LONGEST_PAGE)
        others = client.list(limit=left, cursor=page.next, **filters)
        page = others.model_copy(update={"jobs": (*page.jobs, *others.jobs)})
    return page


def save_picture(client: Client, job_id: str, out: ImageTarget, layers: Iterable[str] = ()) -> None:
    """Write the image of a job and some of its layers, or their finished parts."""
    from service.client.pictures import kind_of

    picture = client.picture(job_id, kind_of(out.path))
    out.write(picture.content)
    output.say(
        f"{out}: " + ("complete" if picture.complete else f"{100 * picture.share:.0f} % rendered so far")
    )
    for name in layers:
        save_layer(out.path, name, client.layer_file(job_id, name).content)


def _show(job: Job) -> None:
    for heading, cell in zip(HEADINGS, _cells(job), strict=True):
        output.result(f"{heading + ':':<11}{cell}")
    if job.queue_position is not None:
        output.result(f"{'queue:':<11}{counted(job.queue_position, 'job')} ahead")
    if job.error is not None:
        output.result(f"{'error:':<11}{output.reached_error(**job.error.model_dump())}")
    if job.damage is not None:
        output.result(f"{'damage:':<11}{job.damage}")
    if job.failure is not None:
        output.result(f"{'failure:':<11}{job.failure.message} ({job.failure.code})")


def _cells(job: Job) -> tuple[str, ...]:
    return (
        job.id,
        state_of(job),
        f"{100 * job.progress.share:.0f} %",
        f"{job.width} x {job.height}",
        f"{job.created_at.astimezone():%Y-%m-%d %H:%M:%S}",
        output.harmless(job.name or ""),
    )


def state_of(job: Job) -> str:
    """The state of a job, and whether it is paused or damaged."""
    remarks = [name for name, holds in (("paused", job.paused), ("damaged", job.damage)) if holds]
    return ", ".join([str(job.state), *remarks])


def logs(job_id: JobArgument, server: ServerOption = DEFAULT_SERVER, as_json: JsonOption = False) -> None:
    """Show the history of a job: states, passes, retries, failures."""
    with connect(server) as client:
        found = client.log(job_id)
    lines = _log_by_day if output.on_terminal() else _log_lines
    output.report(found, lines(found.entries), as_json=as_json)
    if found.more and not as_json:
        output.say(f"Retried tiles that are not listed: {found.more:,}.")


def _log_lines(entries: Iterable[LogEntry]) -> Iterator[str]:
    """Time, event and message with tabs between them; no time where only the order is known."""
    for entry in entries:
        at = f"{entry.at.astimezone():%Y-%m-%d %H:%M:%S}" if entry.at else ""
        yield f"{at}\t{entry.event}\t{output.harmless(entry.message)}"


def _log_by_day(entries: Iterable[LogEntry]) -> Iterator[str]:
    """Times and messages grouped by day, to fit into 80 columns."""
    day = None
    for entry in entries:
        at = entry.at.astimezone() if entry.at else None
        if at is not None and at.date() != day:
            day = at.date()
            yield f"{day}"
        yield f"  {f'{at:%H:%M:%S}' if at else '':<8}  {output.harmless(entry.message)}"
