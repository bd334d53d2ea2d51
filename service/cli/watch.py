"""``penumbra wait`` and ``watch``: follow a job until it ends, with its error pass by pass."""

from __future__ import annotations

import time
from collections.abc import Callable
from contextlib import contextmanager
from dataclasses import dataclass
from math import log2
from typing import TYPE_CHECKING

from service.cli import output
from service.cli.options import (
    DEFAULT_SERVER,
    LONG_RETRY,
    JobArgument,
    JsonOption,
    ServerOption,
    TimeoutOption,
    connect,
)
from service.cli.progress import Bar, progress_bar, remaining
from service.cli.tev import Mirror, TevOption, mirror

if TYPE_CHECKING:
    from collections.abc import Iterator

    from schemas.api.jobs import Job, TileBatch
    from schemas.api.plans import Convergence, Interval, PassCost
    from service.client import Client

SECONDS_BETWEEN_RAY_COUNTS = 1.0


def wait(
    job_id: JobArgument,
    server: ServerOption = DEFAULT_SERVER,
    timeout: TimeoutOption = None,
    as_json: JsonOption = False,
) -> None:
    """Wait until a job has ended, without showing its progress."""
    with connect(server, retry=LONG_RETRY) as client, detachable(job_id):
        show_end(client.wait(job_id, timeout=timeout), as_json=as_json)


def watch(
    job_id: JobArgument,
    server: ServerOption = DEFAULT_SERVER,
    timeout: TimeoutOption = None,
    tev: TevOption = None,
    as_json: JsonOption = False,
) -> None:
    """Show a job's tiles as they finish, and the error of each pass.

    On a terminal they are a bar, on a pipe lines.

    Ctrl-C stops watching, not the job. A second watch shows all tiles again.
    """
    with connect(server, retry=LONG_RETRY) as client, detachable(job_id):
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
        Where there is no bar, print a line for each tile and for each pass.
    shown
        Another viewer of the picture.
    """
    with progress_bar("waiting") as bar:
        curve = Curve(client, job_id, bar)
        show = _bar_of(client, job_id, bar, curve) if bar.visible else _lines_of(curve) if lines else None

        def on_progress(batch: TileBatch) -> None:
            if shown is not None:
                shown.show()
            if show is not None:
                show(batch)

        return client.wait(job_id, timeout=timeout, on_progress=on_progress)


def show_end(job: Job, *, as_json: bool) -> None:
    """Report how a job ended."""
    if as_json:
        output.document(job)
    else:
        output.say(f"Job {job.id} is done: {job.width} x {job.height} pixels, {_cost(job)}")


@contextmanager
def detachable(job_id: str) -> Iterator[None]:
    """Say on Ctrl-C that the job keeps running."""
    try:
        yield
    except KeyboardInterrupt:
        output.say(f"Job {job_id} keeps running. Watch it again with: penumbra watch {job_id}")
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
    """Whether passes are planned one after another, so that the number of tiles is not known."""
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


HEADINGS = ("pass", "seconds", "CPU s", "rays", "error")
ROW = "{:>4}{:>9}{:>9}{:>9}   {:<27}"
"""A row of the table on a terminal."""

BAR_CELLS = 20
"""Length of the bar of the first known error."""

CELLS_PER_HALVING = 2
"""Cells by which a bar is shorter at half the error."""


@dataclass(slots=True)
class Curve:
    """The passes of a job, shown as they end: on a terminal with a bar each, on a pipe with tabs."""

    client: Client
    job_id: str
    bar: Bar
    passes_shown: int = 0
    reached: int = 0
    found: Convergence | None = None
    first_error: float | None = None

    def reach(self, pass_index: int) -> None:
        """Show the finished passes before this one, of which a tile has arrived."""
        if pass_index <= self.reached:
            return
        self.reached = pass_index
        if self.found is None or len(self.found.passes) < pass_index:
            self.found = self.client.convergence(self.job_id)
        self._show_passes(self.found, pass_index)
        self.bar.below("\n".join(sentences(self.found, final=False)))

    def finish(self) -> None:
        """Show all passes of a job that has ended, and the sentences about them."""
        found = self.client.convergence(self.job_id)
        self._show_passes(found, len(found.passes))
        said = list(sentences(found, final=True))
        self.bar.below("\n".join(said))
        if not self.bar.visible:
            for sentence in said:
                output.result(sentence)

    def _show_passes(self, found: Convergence, before: int) -> None:
        for entry in found.passes[self.passes_shown : before]:
            if not self.bar.visible:
                output.result(_line(entry))
            else:
                if not self.passes_shown:
                    self.bar.above(ROW.format(*HEADINGS))
                self.bar.above(ROW.format(*_cells(entry)) + self._drawn(entry))
            self.passes_shown += 1

    def _drawn(self, entry: PassCost) -> str:
        """A bar for an error, `CELLS_PER_HALVING` shorter for each half of it."""
        if entry.error is None or entry.error.estimate <= 0:
            return ""
        self.first_error = self.first_error or entry.error.estimate
        return "  " + self.bar.block * max(
            1, round(BAR_CELLS + CELLS_PER_HALVING * log2(entry.error.estimate / self.first_error))
        )


def _cells(entry: PassCost) -> tuple[str, ...]:
    rays = f"{sum(entry.rays.values()) / 1e6:.2f} M"
    seconds = (f"{entry.seconds:.2f}", f"{entry.cpu_seconds:.2f}")
    return (str(entry.pass_index), *seconds, rays, _error(entry) or "-")


def _line(entry: PassCost) -> str:
    return (
        f"pass {entry.pass_index} done\t{entry.seconds:.2f} s\t{entry.cpu_seconds:.2f} CPU s\t"
        f"{sum(entry.rays.values())} rays\terror {_error(entry) or 'unknown'}"
    )


def _error(entry: PassCost) -> str | None:
    return None if entry.error is None else output.reached_error(**entry.error.model_dump())


def sentences(found: Convergence, *, final: bool) -> Iterator[str]:
    """Say how fast the error falls and what half of it would cost.

    Parameters
    ----------
    final
        No more passes follow: say why a value is unknown.
    """
    known = [entry for entry in found.passes if entry.error is not None]
    if known:
        falls = f", falling like time to the power {_interval(found.order)}" if found.order else ""
        yield f"error {_error(known[-1])}{falls}"
    if found.next_halving is not None:
        seconds, cpu_seconds = found.next_halving.seconds, found.next_halving.cpu_seconds
        yield f"half of it would take {_interval(seconds, ' s more')}, {_interval(cpu_seconds, ' CPU s')}"
    if found.reason is not None and (final or found.order is not None):
        yield found.reason


def _interval(found: Interval, unit: str = "") -> str:
    """Write an estimate with its interval, in two digits."""
    end = "or more" if found.high is None else f"to {_short(found.high)}"
    return f"{_short(found.estimate)}{unit} ({_short(found.low)} {end})"


def _short(number: float) -> str:
    """Write a number with two digits or all before the point, never with an exponent where it is not small.

    >>> [_short(number) for number in (-0.507, 1234.5, 48.8, 0.0123)]
    ['-0.51', '1234', '49', '0.012']
    """
    return f"{number:.0f}" if abs(number) >= 10 else f"{number:.2g}"
