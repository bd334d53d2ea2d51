"""``penumbra wait`` and ``watch``: stay with a job until it ends."""

from __future__ import annotations

import time
from collections.abc import Callable
from contextlib import contextmanager
from typing import TYPE_CHECKING

from service.cli import output
from service.cli.connection import (
    DEFAULT_SERVER,
    LONG_PATIENCE,
    JobArgument,
    ServerOption,
    TimeoutOption,
    connect,
)
from service.cli.convergence import Curve
from service.cli.progress import Bar, progress_bar, remaining
from service.cli.tev import Mirror, TevOption, mirror

if TYPE_CHECKING:
    from collections.abc import Iterator

    from schemas.jobs import Job, TileBatch
    from service.client import Client

SECONDS_BETWEEN_RAY_COUNTS = 1.0


def wait(
    job_id: JobArgument,
    server: ServerOption = DEFAULT_SERVER,
    timeout: TimeoutOption = None,
    as_json: output.JsonOption = False,
) -> None:
    """Wait in silence until a job has its image."""
    with connect(server, patience=LONG_PATIENCE) as client, detachable(job_id):
        show_end(client.wait(job_id, timeout=timeout), as_json=as_json)


def watch(
    job_id: JobArgument,
    server: ServerOption = DEFAULT_SERVER,
    timeout: TimeoutOption = None,
    tev: TevOption = None,
    as_json: output.JsonOption = False,
) -> None:
    """Show a job's tiles and the error after each pass: a bar on a terminal, lines on a pipe.

    It may be left with Ctrl-C and started again: the job goes on, and its first tiles are shown again.
    """
    with connect(server, patience=LONG_PATIENCE) as client, detachable(job_id):
        with mirror(client, job_id, tev) as shown:
            job = stay(client, job_id, timeout=timeout, lines=not as_json, shown=shown)
        show_end(job, as_json=as_json)


def stay(
    client: Client,
    job_id: str,
    *,
    timeout: float | None = None,
    lines: bool = False,
    shown: Mirror | None = None,
) -> Job:
    """Show a job's progress until it has its image.

    Parameters
    ----------
    lines
        Where nobody sees a bar, print a line for each tile and for each pass.
    shown
        Where the picture is shown besides.
    """
    with progress_bar("waiting") as bar:
        curve = Curve(client, job_id, bar)
        show = _bar_of(client, job_id, bar, curve) if bar.visible else _lines_of(curve) if lines else None
        return client.wait(job_id, timeout=timeout, on_progress=_both(show, shown))


def _both(
    show: Callable[[TileBatch], None] | None, shown: Mirror | None
) -> Callable[[TileBatch], None] | None:
    if shown is None:
        return show

    def both(batch: TileBatch) -> None:
        shown.show()
        if show is not None:
            show(batch)

    return both


def show_end(job: Job, *, as_json: bool) -> None:
    """Tell how a job ended."""
    if as_json:
        output.document(job.model_dump(mode="json"))
    else:
        output.say(f"Job {job.id} is done: {job.width} x {job.height} pixels, {_cost(job)}")


@contextmanager
def detachable(job_id: str) -> Iterator[None]:
    """Say on Ctrl-C that only the watching ends."""
    try:
        yield
    except KeyboardInterrupt:
        output.say(f"Job {job_id} goes on. See it again with: penumbra watch {job_id}")
        raise


def _bar_of(client: Client, job_id: str, bar: Bar, curve: Curve) -> Callable[[TileBatch], None]:
    counted = 0.0
    rays = ""
    grows = False

    def show(batch: TileBatch) -> None:
        nonlocal counted, rays, grows
        if time.monotonic() - counted > SECONDS_BETWEEN_RAY_COUNTS or batch.complete:
            counted = time.monotonic()
            job = client.get(job_id)
            rays, grows = _rays(job), _is_target(job)
        bar.show(batch.progress.share, f"{_tiles(batch, grows)}{rays}", title=batch.state)
        curve.reach(max((event.pass_index for event in batch.events), default=0))
        if batch.complete:
            curve.finish()

    return show


def _lines_of(curve: Curve) -> Callable[[TileBatch], None]:
    def show(batch: TileBatch) -> None:
        for event in batch.events:
            curve.reach(event.pass_index)
            output.result(
                f"{event.seq}/{batch.progress.total}\tpass {event.pass_index}\ttile {event.tile}\t"
                f"x {event.x0}-{event.x1}\ty {event.y0}-{event.y1}"
            )
        if batch.complete:
            curve.finish()

    return show


def _is_target(job: Job) -> bool:
    """Whether a job gets its passes one after another, so that nobody knows how many tiles there will be."""
    return job.quality.get("mode") == "target"


def _tiles(batch: TileBatch, grows: bool) -> str:
    done = batch.progress
    of = "" if grows else f" of {done.total}"
    return f"tile {done.done}{of}{remaining(done.remaining_seconds)}"


def _rays(job: Job) -> str:
    total = sum(job.cost.rays.values())
    return f", {total / 1e6:.1f} million rays" if total else ""


def _cost(job: Job) -> str:
    seconds = ""
    if job.started_at is not None and job.finished_at is not None:
        seconds = f"{(job.finished_at - job.started_at).total_seconds():.2f} s, "
    error = f", error {output.reached_error(**job.error.model_dump())}" if job.error else ""
    return f"{seconds}{job.cost.cpu_seconds:.2f} CPU s{_rays(job)}{error}"
