"""The dispatcher's transactions: claims of the next steps, and results of those handed out.

Every function works in a transaction of its caller, so that the results and the claims of one round
are one write.
"""

from __future__ import annotations

from collections.abc import Collection, Iterator, Sequence
from dataclasses import replace

from sqlalchemy import and_, bindparam, case, exists, literal_column, select, update
from sqlalchemy.orm import Session

from schemas.api.jobs import JobState
from service.dispatch import adaptive_passes as adaptive
from service.lifecycle import fairness, progress, rows
from service.lifecycle.damage import using
from service.storage.database.models import DONE, RUNNING, WAITING, JobRow, RenderRow, ShareRow, TileRow
from service.storage.tiles import StoredTile
from service.workers.tasks import (
    ComposeDone,
    ComposeTask,
    InputDamaged,
    JobTask,
    Preempted,
    SampleTask,
    TileDone,
    TileTask,
)

# Built once: making a statement takes longer than executing it, and these run for every tile.
# SQLite uses the index of waiting steps only where the condition stands in the statement as in the index.
_IS_WAITING = TileRow.state == literal_column("'waiting'")
_STARTED = RenderRow.state == JobState.RUNNING
_RENDER = select(RenderRow).where(RenderRow.id == bindparam("id")).with_for_update()
_CLAIMABLE = (
    select(RenderRow)
    .join(JobRow, JobRow.render_number == RenderRow.number)
    .where(JobRow.owner == bindparam("owner"), JobRow.finished_at.is_(None), JobRow.paused_at.is_(None))
    .where(~RenderRow.cancel_requested)
    .where(RenderRow.number.not_in(bindparam("begun", expanding=True)))
    .where(exists().where(TileRow.render == RenderRow.number, _IS_WAITING))
    .order_by(_STARTED, JobRow.priority.desc(), JobRow.number)
    .limit(bindparam("room"))
)
_WAITING = (
    select(TileRow)
    .where(TileRow.render == bindparam("render"), _IS_WAITING)
    .where(TileRow.pass_index <= bindparam("last_pass"))
    .order_by(TileRow.pass_index, TileRow.tile)
    .limit(bindparam("room"))
)
_IN_FOCUS = and_(
    TileRow.x0 < bindparam("x1"),
    TileRow.x1 > bindparam("x0"),
    TileRow.y0 < bindparam("y1"),
    TileRow.y1 > bindparam("y0"),
)
_WAITING_IN_FOCUS = _WAITING.order_by(None).order_by(
    TileRow.pass_index, case((_IN_FOCUS, 0), else_=1), TileRow.tile
)
_PAYERS = select(TileRow.payer).where(TileRow.state == literal_column("'running'")).distinct()
_OWNERS = select(JobRow.owner).where(JobRow.finished_at.is_(None)).distinct()
_RENDERED = (
    select(RenderRow)
    .where(_STARTED, ~RenderRow.cancel_requested, RenderRow.done_steps == RenderRow.total_steps)
    .order_by(RenderRow.number)
)


def recover(session: Session) -> int:
    """Take back the unfinished steps that a service that is gone had handed out, and count them."""
    handed_out = update(TileRow).where(TileRow.state == RUNNING)
    waiting_again = handed_out.values(state=WAITING, payer=None, charge=0.0).returning(TileRow.tile)
    taken_back = len(session.execute(waiting_again).all())
    fairness.activate(session, session.scalars(_OWNERS).all())
    left = select(RenderRow).where(RenderRow.state == JobState.RUNNING, RenderRow.cancel_requested)
    for render in session.scalars(left).all():
        rows.end(session, render, JobState.CANCELLED)
    return taken_back


def take_back_unknown(session: Session, known: Collection[JobTask]) -> int:
    """Let steps that were handed out, but have no known task, wait again, and count them."""
    taken_back = 0
    tasks = (task for task in known if isinstance(task, TileTask))
    found = {(task.job, task.pass_.index, task.tile.index, task.attempt) for task in tasks}
    handed_out = select(TileRow, RenderRow).join(RenderRow, TileRow.render == RenderRow.number)
    for step, render in session.execute(handed_out.where(TileRow.state == RUNNING)).all():
        if (render.id, step.pass_index, step.tile, step.attempt) not in found:
            step.state = WAITING
            taken_back += 1
            fairness.settle(session, step, 0.0)
            fairness.activate_all_of(session, render)
    return taken_back


def unwanted(session: Session) -> Sequence[str]:
    """Return the ids of the running renders that any server has cancelled."""
    return session.scalars(select(RenderRow.id).where(_STARTED, RenderRow.cancel_requested)).all()


def render_of(session: Session, render_id: str) -> RenderRow | None:
    """Find a render and keep others from changing it until the transaction ends."""
    return session.scalar(_RENDER, {"id": render_id})


def payers(session: Session) -> set[str]:
    """Return the users for whom tiles are rendered now."""
    return set(filter(None, session.scalars(_PAYERS)))


def tile_claims(session: Session, room: int, served: Collection[str] = ()) -> Iterator[TileTask]:
    """Hand out the next steps, at most ``room``, to the users whose turn it is, ``served`` ones left out."""
    begun, resting = set[int](), set(served)
    while room > 0:
        share, until = fairness.next_share(session, resting)
        if share is None:
            return
        claimed = 0
        # One by one, so that the steps before a damaged render are handed out.
        for task in _turn(session, share, until, room, begun):
            claimed += 1
            yield task
        if not claimed:
            resting.add(share.owner)
            share.active = bool(begun) and _waits(session, share.owner)
        room -= claimed


def _turn(session: Session, share: ShareRow, until: float, room: int, begun: set[int]) -> Iterator[TileTask]:
    """Hand out steps of a user's jobs, as long as the user's clock is not past ``until``.

    Each job gets its coarse picture before any of them continues, and jobs that have ``begun`` in this round
    get nothing else; then they follow by priority and age, all tiles of one pass before any tile of the next.
    """
    wanted = {"owner": share.owner, "room": room, "begun": list(begun)}
    for render in session.scalars(_CLAIMABLE, wanted).unique().all():
        with using(render):
            last_pass = len(render.passes)
        if render.state == JobState.QUEUED:
            last_pass = 0
            begun.add(render.number)
        for step in _waiting(session, render, last_pass, room):
            with using(render):
                fairness.charge(share, step, rows.expected_cpu_seconds(render, step))
                task = _hand_out(session, render, step)
            yield task
            room -= 1
            if not room or share.served > until:
                return


def _waiting(session: Session, render: RenderRow, last_pass: int, room: int) -> Sequence[TileRow]:
    """Return the next waiting steps of a render, at most ``room``; in each pass those in focus first."""
    wanted = {"render": render.number, "last_pass": last_pass, "room": room}
    if render.focus is None:
        return session.scalars(_WAITING, wanted).all()
    return session.scalars(_WAITING_IN_FOCUS, wanted | render.focus).all()


def _waits(session: Session, owner: str) -> bool:
    """Whether a user has a waiting step."""
    return session.scalar(_CLAIMABLE, {"owner": owner, "room": 1, "begun": []}) is not None


def _hand_out(session: Session, render: RenderRow, step: TileRow) -> TileTask:
    if render.state == JobState.QUEUED:
        rows.begin(session, render)
    step.state = RUNNING
    step.attempt += 1
    place = (
        render.id,
        render.spec_sha256,
        rows.tile_of(step),
        rows.passes_of(render)[step.pass_index],
        step.attempt,
    )
    if render.target_error is None:
        return TileTask(*place, resumed=step.cpu_seconds is not None)
    if step.pass_index == 0:
        return SampleTask(*place, merged=0, seconds_left=None)
    return SampleTask(
        *place,
        merged=adaptive.merged_by(render),
        seconds_left=adaptive.tile_time_left(render),
        ray_seconds=render.merges[-1]["ray_seconds"],
        checksums=rows.checksums_of(render),
    )


def land(session: Session, render: RenderRow, task: TileTask, done: TileDone) -> bool:
    """Record a finished step. False if it is a stale attempt."""
    step = _handed_out(session, render, task)
    if step is None:
        return False
    cpu_seconds = _pay(session, render, step, done.cpu_seconds)
    render.last_seq += 1
    render.done_steps += 1
    render.done_work += (
        done.counts["camera"] if isinstance(task, SampleTask) else rows.work(task.pass_, task.tile)
    )
    render.rays = progress.add_counts(render.rays, done.counts)
    render.work = progress.add_counts(render.work, done.work)
    if render.target_error is None:
        progress.note_step(render, task.pass_.index, replace(done, cpu_seconds=cpu_seconds))
    step.state, step.seq, step.crc32 = DONE, render.last_seq, done.crc32
    return True


def preempt(session: Session, render: RenderRow, task: TileTask, stopped: Preempted) -> bool:
    """Let a step wait for its next time slice, or its quarters. False if it is a stale attempt."""
    step = _handed_out(session, render, task)
    if step is None:
        return False
    _pay(session, render, step, stopped.cpu_seconds)
    step.state = WAITING
    if isinstance(task, SampleTask):
        adaptive.quarter(session, render, step)
    fairness.activate_all_of(session, render)
    return True


def _pay(session: Session, render: RenderRow, step: TileRow, cpu_seconds: float) -> float:
    """Charge the cost of a task to its user and its render; return what the step has cost so far."""
    fairness.settle(session, step, cpu_seconds)
    render.cpu_seconds += cpu_seconds
    step.cpu_seconds = (step.cpu_seconds or 0.0) + cpu_seconds
    return step.cpu_seconds


def take_back(session: Session, render: RenderRow, task: TileTask) -> bool:
    """Let a step wait again. False if it is a stale attempt, which changes nothing."""
    step = _handed_out(session, render, task)
    if step is None:
        return False
    step.state = WAITING
    fairness.settle(session, step, 0.0)
    fairness.activate_all_of(session, render)
    return True


def note_death(session: Session, render: RenderRow, task: TileTask) -> int:
    """Return the number of workers that a step has cost, this one included; it stays handed out.

    0 if it is a stale attempt, which changes nothing.
    """
    step = _handed_out(session, render, task)
    if step is None:
        return 0
    step.deaths += 1
    return step.deaths


def repair(session: Session, render: RenderRow, damaged: InputDamaged, most: int) -> bool:
    """Have the contents of damaged files rendered again; False after ``most`` repairs."""
    if render.damage_count >= most:
        return False
    render.damage_count += 1
    if damaged.merged:
        adaptive.undo_merge(session, render)
    for pass_index, tile in () if damaged.merged else damaged.steps:
        step = session.get(TileRow, (render.number, pass_index, tile))
        if step is not None and step.state == DONE:
            # Its event gets a new number once it is finished: watchers have read beyond the old one.
            step.state, step.seq, step.crc32, step.cpu_seconds = WAITING, None, None, None
            render.done_steps -= 1
            if render.target_error is None:
                progress.take_back_step(render, pass_index)
    fairness.activate_all_of(session, render)
    return True


def compose_claims(session: Session, composing: Collection[str]) -> Iterator[JobTask]:
    """Hand out the tasks that assemble finished renders, except those in ``composing``."""
    for render in session.scalars(_RENDERED).all():
        if render.id not in composing:
            # Never reset: a worker of a former leader may still write files with the earlier numbers.
            render.compose_attempt += 1
            with using(render):
                task = _compose_task(session, render)
            yield task


def _compose_task(session: Session, render: RenderRow) -> JobTask:
    if render.target_error is not None:
        return adaptive.advance_task(session, render)
    parts = tuple(sampled(session, render))
    return ComposeTask(
        job=render.id,
        width=render.width,
        height=render.height,
        parts=parts,
        attempt=render.compose_attempt,
        layers=tuple(render.layers),
        compared=render.error_unknown is None,
    )


def complete(session: Session, render: RenderRow, task: ComposeTask, done: ComposeDone) -> None:
    """Record a final picture and its files."""
    progress.note_errors(render, done.errors)
    picture = rows.FinalPicture(done.sha256, task.attempt, done.numerics, done.checksums)
    rows.succeed(session, render, picture)


def sampled(
    session: Session, render: RenderRow, tiles: Collection[int] | None = None
) -> Iterator[StoredTile]:
    """Iterate over the finished steps that have samples, tile by tile, each in the order of its passes."""
    passes = rows.passes_of(render)
    query = select(TileRow).where(
        TileRow.render == render.number, TileRow.state == DONE, TileRow.pass_index > 0
    )
    if tiles is not None:
        query = query.where(TileRow.tile.in_(tiles))
    for step in session.scalars(query.order_by(TileRow.tile, TileRow.pass_index)):
        yield rows.stored(step, passes)


def coarse(session: Session, render: RenderRow) -> StoredTile | None:
    """Return the coarse picture of a render, if it is finished."""
    step = session.get(TileRow, (render.number, 0, 0))
    return rows.stored(step, rows.passes_of(render)) if step and step.state == DONE else None


def _handed_out(session: Session, render: RenderRow, task: TileTask) -> TileRow | None:
    if render.state != JobState.RUNNING or render.cancel_requested:
        return None
    step = session.get(TileRow, (render.number, task.pass_.index, task.tile.index))
    return step if step and step.state == RUNNING and step.attempt == task.attempt else None
