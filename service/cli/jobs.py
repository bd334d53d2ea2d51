"""``penumbra get``, ``ls`` and ``logs``: what a service knows of its jobs."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from typing import TYPE_CHECKING, Annotated, Any, Literal

import typer

from service.cli import output
from service.cli.connection import (
    DEFAULT_SERVER,
    JobArgument,
    LabelOption,
    ServerOption,
    connect,
    parsed_labels,
)
from service.cli.errors import CommandError
from service.cli.targets import (
    ImageTarget,
    LayersOption,
    check_layer_targets,
    check_target,
    parsed_layers,
    save_layer,
)
from service.cli.watch import CURVE_FORMS, CurveOption, save_curve

if TYPE_CHECKING:
    from schemas.jobs import Job, JobList
    from schemas.logs import LogEntry
    from service.client import Client

OutOption = Annotated[
    ImageTarget | None,
    typer.Option(
        "-o",
        "--out",
        parser=ImageTarget.named,
        metavar="FILE",
        help="Save the image: .png, .npy for linear float32, or .exr; - or -.npy is stdout.",
    ),
]
LimitOption = Annotated[int, typer.Option(min=1, help="How many jobs, the newest first.")]
CursorOption = Annotated[
    str | None, typer.Option("--after", metavar="CURSOR", help="Go on where a list before this one ended.")
]
# Written down twice so that `penumbra --help` need not load the schemas; a test compares the two.
State = Literal["queued", "running", "succeeded", "failed", "cancelled", "expired"]
StateOption = Annotated[State | None, typer.Option("--state", help="Only jobs in this state.")]
HEADINGS = ("id", "state", "done", "pixels", "submitted", "scene")


def get(
    job_id: JobArgument,
    out: OutOption = None,
    layers: LayersOption = None,
    curve: CurveOption = None,
    server: ServerOption = DEFAULT_SERVER,
    as_json: output.JsonOption = False,
) -> None:
    """Show a job, or save its image and what its error costs; of a running job what there is of it."""
    names = parsed_layers(layers)
    if names and out is None:
        raise CommandError("--layers are saved beside the image. Give -o too.")
    if out is not None:
        out.check(with_layers=bool(names), as_json=as_json)
        check_layer_targets(out.path, names)
    if curve is not None:
        check_target(curve, CURVE_FORMS)
    with connect(server) as client:
        if names:
            _check_layers(client.get(job_id), names)
        if out is not None:
            save_picture(client, job_id, out, names)
        if curve is not None:
            save_curve(client, job_id, curve)
        job = client.get(job_id)
    if as_json:
        output.document(job.model_dump(mode="json"))
    elif out is None and curve is None:
        _show(job)


def _check_layers(job: Job, names: Iterable[str]) -> None:
    """Raise CommandError, before anything is written, where a job was not submitted with these layers."""
    missing = [name for name in names if name not in job.links.layers]
    if missing:
        there = ", ".join(job.links.layers) or "none"
        raise CommandError(
            f"--layers: Job {job.id} has no layer {' or '.join(missing)}. The layers it was submitted with: "
            f"{there}."
        )


def ls(
    limit: LimitOption = 20,
    after: CursorOption = None,
    state: StateOption = None,
    label: LabelOption = None,
    server: ServerOption = DEFAULT_SERVER,
    as_json: output.JsonOption = False,
) -> None:
    """List the jobs of a service, the newest first."""
    wanted = parsed_labels(label)
    from service.client import RequestInvalidError

    try:
        with connect(server) as client:
            page = _listed(client, limit, after, {"state": state, "labels": wanted})
    except RequestInvalidError as error:
        raise CommandError(error.document.detail or str(error)) from error
    if as_json:
        output.document(page.model_dump(mode="json"))
        return
    if output.on_terminal():
        _show_table(page.jobs)
    else:
        for job in page.jobs:
            output.result("\t".join(_cells(job)))
    if page.next is not None:
        output.say(f"There are more: --after {page.next}")


def _listed(client: Client, limit: int, cursor: str | None, filters: dict[str, Any]) -> JobList:
    """So many jobs, from as many pages as they take."""
    from service.client.calls import LONGEST_PAGE

    page = client.list(limit=min(limit, LONGEST_PAGE), cursor=cursor, **filters)
    while page.next is not None and len(page.jobs) < limit:
        left = min(limit - len(page.jobs), LONGEST_PAGE)
        others = client.list(limit=left, cursor=page.next, **filters)
        page = others.model_copy(update={"jobs": (*page.jobs, *others.jobs)})
    return page


def save_picture(client: Client, job_id: str, out: ImageTarget, layers: Iterable[str] = ()) -> None:
    """Write the image of a job and some of its layers, or what there is of them."""
    from service.client.pictures import kind_of

    picture = client.picture(job_id, kind_of(out.path))
    out.write(picture.content)
    output.say(f"{out}: " + ("complete" if picture.complete else f"{picture.share:.0%} rendered so far"))
    for name in layers:
        save_layer(out.path, name, client.layer_file(job_id, name).content)


def _show(job: Job) -> None:
    for heading, cell in zip(HEADINGS, _cells(job), strict=True):
        output.result(f"{heading + ':':<11}{cell}")
    if job.queue_position is not None:
        output.result(f"{'queue:':<11}{job.queue_position} before it")
    if job.error is not None:
        output.result(f"{'error:':<11}{output.reached_error(**job.error.model_dump())}")
    if job.failure is not None:
        output.result(f"{'failure:':<11}{job.failure.message} ({job.failure.code})")


def _show_table(jobs: Iterable[Job]) -> None:
    from rich import box
    from rich.console import Console
    from rich.table import Table
    from rich.text import Text

    table = Table(*HEADINGS, box=box.SIMPLE_HEAD)
    for job in jobs:
        table.add_row(*(Text(cell) for cell in _cells(job)))
    Console().print(table)


def _cells(job: Job) -> tuple[str, ...]:
    return (
        job.id,
        state_of(job),
        f"{job.progress.share:.0%}",
        f"{job.width} x {job.height}",
        f"{job.created_at.astimezone():%Y-%m-%d %H:%M:%S}",
        output.harmless(job.name or ""),
    )


def state_of(job: Job) -> str:
    """The state of a job, in words."""
    return f"{job.state}, paused" if job.paused else str(job.state)


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
    for line in (_log_by_day if output.on_terminal() else _log_lines)(found.entries):
        output.result(line)
    if found.more:
        output.say(f"{found.more} more tiles were repeated.")


def _log_lines(entries: Iterable[LogEntry]) -> Iterator[str]:
    """Time, word and sentence with tabs between them; no time where only the order is known."""
    for entry in entries:
        at = f"{entry.at.astimezone():%Y-%m-%d %H:%M:%S}" if entry.at else ""
        yield f"{at}\t{entry.event}\t{output.harmless(entry.message)}"


def _log_by_day(entries: Iterable[LogEntry]) -> Iterator[str]:
    """Times and sentences under the days to which they belong: a terminal may have only 80 columns."""
    day = None
    for entry in entries:
        at = entry.at.astimezone() if entry.at else None
        if at is not None and at.date() != day:
            day = at.date()
            yield f"{day}"
        yield f"  {f'{at:%H:%M:%S}' if at else '':<8}  {output.harmless(entry.message)}"
