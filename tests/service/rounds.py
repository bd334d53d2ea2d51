"""Jobs in a database and rounds of the dispatcher over them, without an engine."""

import time
from collections.abc import Sequence
from dataclasses import asdict
from datetime import UTC, datetime, timedelta
from typing import Any

from sqlalchemy import select

from renderer import tiling
from schemas.tiles import Tile
from service.dispatch import ledger
from service.dispatch.rounds import Round
from service.lifecycle import progress, rows, sharing
from service.storage.database.connection import Database
from service.storage.database.models import JobRow, RenderRow, ShareRow, TileRow
from service.workers.tasks import (
    ComposeDone,
    ComposeTask,
    JobTask,
    Outcome,
    Released,
    TileDone,
    TileTask,
    pass_of,
)
from tests.service.support import enter

DONE = TileDone(
    crc32=2**32 - 1, counts={"camera": 3, "mirror": 0}, cpu_seconds=0.5, work={"shading_points": 2}
)
MAX_ATTEMPTS = 3
QUARTERS = {
    number: Tile(number, 32 * column, 32 * row, 32 * column + 32, 32 * row + 32)
    for number, (row, column) in enumerate(((0, 0), (0, 1), (1, 0), (1, 1)), 1)
}


class Picture:
    """64 x 64 pixels in tiles of 32 x 32."""

    width = height = 64


class Table:
    """Jobs of 64 x 64 pixels in a database, and the tasks that workers have."""

    def __init__(self, database: Database) -> None:
        self.database = database
        self.flying: list[JobTask] = []

    def add(self, job_id: str, *, samples: int = 4, price: float = 1.0, **fields: Any) -> None:
        """Add a job of a coarse picture and then four tiles a pass: two passes, or one with one sample."""
        passes = tiling.passes(64, 64, samples)
        steps = [(pass_, tile) for pass_ in passes for tile in tiling.tiles(Picture(), pass_, 32)]
        self._enter(
            job_id,
            steps,
            fields,
            passes=[asdict(pass_) for pass_ in passes],
            total_work=sum(rows.work(pass_, tile) for pass_, tile in steps),
            predicted_cpu_seconds=price,
            numerics={"retried": 1},
            pass_costs=progress.begin_passes([pass_.index for pass_, _ in steps]),
        )

    def add_target(self, job_id: str = "a", time_limit: float | None = None) -> None:
        """Add a job with a target error: four tiles in the first pass, and what is decided in later ones."""
        self._enter(
            job_id,
            [(pass_of(0), tile) for tile in QUARTERS.values()],
            {},
            passes=[asdict(pass_of(0))],
            total_work=100,
            predicted_cpu_seconds=1.0,
            target_error=0.01,
            time_limit=time_limit,
            tile_size=32,
        )

    def _enter(self, job_id: str, steps: list[Any], fields: dict[str, Any], **columns: Any) -> None:
        render = RenderRow(
            id=job_id, width=64, height=64, spec_sha256="", display={}, total_steps=len(steps), **columns
        )
        with self.database.writing() as session:
            enter(session, job_id, render, **fields)
            session.add_all(TileRow(**rows.new_step(render.number, *step)) for step in steps)

    def composing(self) -> ComposeTask:
        """Finish all tiles of the only job, and return what composes its picture."""
        (task,) = self.round(*((task, DONE) for task in [self.next() for _ in range(9)])).tasks
        assert isinstance(task, ComposeTask)
        return task

    def join(self, job_id: str, other: str, owner: str) -> None:
        """Let another job share the render of a job."""
        with self.database.writing() as session:
            job = enter(session, other, session.merge(self.render(job_id)), owner=owner)
            sharing.follow(session, job.render)

    def round(
        self,
        *reports: tuple[JobTask, Outcome],
        room: int = 0,
        idle: int | None = None,
        spare: int = 0,
        leaving: Sequence[str] = (),
        begun_before: float = 0.0,
    ) -> Round:
        self.flying = [task for task in self.flying if task not in {done for done, _ in reports}]
        result = Round(
            reports,
            self.flying,
            leaving,
            room,
            room if idle is None else idle,
            spare,
            MAX_ATTEMPTS,
            worker_bytes=4 << 30,
            begun=time.monotonic() - begun_before,
        )
        with self.database.writing() as session:
            result.decide(session)
        self.flying += [*result.tasks, *(task for task, _ in result.held)]
        return result

    def release(self, last: Round, room: int = 0) -> Round:
        """A round after the tasks were held back for long enough that the last one has held."""
        return self.round(*((task, Released()) for task, _ in last.held), room=room)

    def next(self) -> TileTask:
        (task,) = self.round(room=1).tasks
        assert isinstance(task, TileTask)
        return task

    def finish(self, cpu_seconds: float = 1.0) -> None:
        """End the tile that has run longest; pictures are composed at once."""
        done = TileDone(crc32=0, counts={"camera": 1}, cpu_seconds=cpu_seconds)
        for task in self.round((self.flying[0], done)).tasks:
            self.round((task, ComposeDone("ab", {})))

    def job(self, job_id: str) -> JobRow:
        with self.database.reading() as session:
            return session.scalars(select(JobRow).where(JobRow.id == job_id)).one()

    def render(self, job_id: str = "a") -> RenderRow:
        render = self.job(job_id).render
        assert render is not None
        return render

    def served(self) -> dict[str, float]:
        with self.database.reading() as session:
            return {share.owner: share.served for share in session.scalars(select(ShareRow))}

    def cancel(self, job_id: str) -> None:
        with self.database.writing() as session:
            found = ledger.render_of(session, job_id)
            assert found is not None
            found.cancel_requested = True

    def restart(self) -> int:
        """Lose all tasks, as a server does that is killed; return how many steps were taken back."""
        self.flying = []
        with self.database.writing() as session:
            return ledger.recover(session)

    def spend(self, seconds: float, job_id: str = "a") -> None:
        """Have a render begun so long ago."""
        with self.database.writing() as session:
            session.merge(self.render(job_id)).started_at = datetime.now(UTC) - timedelta(seconds=seconds)


def places(tasks: Sequence[JobTask]) -> list[tuple[str, int, int]]:
    return [(task.job, task.pass_.index, task.tile.index) for task in tasks if isinstance(task, TileTask)]
