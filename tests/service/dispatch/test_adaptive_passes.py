"""Decisions of the dispatcher about jobs with a target error."""

from collections import Counter
from dataclasses import replace

import pytest

import renderer
from renderer.adaptive import Estimate
from renderer.adaptive.forecast import Forecast, forecast, usual_prices
from schemas.api.jobs import JobState
from schemas.quality import TargetQuality
from schemas.tiles import Tile
from service.dispatch import adaptive_passes
from service.dispatch.rounds import Round
from service.lifecycle import progress, rows
from service.storage.database.connection import Database
from service.storage.database.models import RenderRow
from service.workers.planning import outline_of
from service.workers.tasks import (
    AdvanceDone,
    AdvanceTask,
    Interrupted,
    JobTask,
    Outcome,
    Preempted,
    SampleTask,
    TileDone,
    WorkerDied,
)
from tests.service.rounds import MAX_ATTEMPTS, QUARTERS, Table
from tests.service.support import BOTH, scene

DONE = TileDone(crc32=1, counts={"camera": 10}, cpu_seconds=0.5)
ERROR = {"estimate": 0.02, "low": 0.01, "high": 0.03}


def advanced(
    *tiles: int, samples: int = 10, later: float = 1.0, merging: float = 0.25, final: bool = False
) -> AdvanceDone:
    """A merged pass; the next one is predicted to take a CPU second."""
    return AdvanceDone(
        tiles=tuple(QUARTERS[number] for number in tiles),
        samples=samples,
        expected=Forecast(next=1.0, later=later, deviation=0.1),
        prices={"pilots": 1e-5},
        ray_seconds=1e-5,
        error=ERROR,
        numerics={"non_finite": 0},
        cpu_seconds=merging,
        sha256="ab" if final else None,
    )


class Targets(Table):
    """One job with a target error."""

    retries: Counter[str]

    def __init__(self, database: Database) -> None:
        super().__init__(database)
        self.retries = Counter()

    def tasks(self, *reports: tuple[JobTask, Outcome], room: int = 8) -> list[JobTask]:
        result = self.round(*reports, room=room)
        self.retries += result.retries
        return result.tasks

    def merging(self) -> AdvanceTask:
        """Finish the tiles of a pass."""
        (task,) = self.tasks(*((task, DONE) for task in self.tasks()))
        assert isinstance(task, AdvanceTask)
        return task

    def merge(self, done: AdvanceDone) -> None:
        self.tasks((self.merging(), done), room=0)

    def share(self) -> float:
        return rows.share(self.render())


@pytest.fixture
def table(database: Database) -> Targets:
    return Targets(database)


@BOTH
def test_pass_is_merged_after_its_last_tile(table: Targets) -> None:
    table.add_target()
    first, *others = table.tasks()
    assert [task.tile.index for task in (first, *others)] == [1, 2, 3, 4]  # type: ignore[union-attr]
    assert table.tasks(*((task, DONE) for task in others)) == []
    (task,) = table.tasks((first, DONE))
    assert isinstance(task, AdvanceTask)
    assert [part.tile.index for part in task.parts] == [1, 2, 3, 4]
    assert (task.merged, task.last) == (0, False)
    second, third = table.tasks((task, advanced(2, 3)))
    assert isinstance(second, SampleTask)
    assert isinstance(third, SampleTask)
    assert (second.pass_.index, second.tile.index, second.merged) == (1, 2, 1)
    assert (third.pass_.index, third.tile.index, third.merged) == (1, 3, 1)
    render = table.render()
    assert (render.done_steps, render.total_steps, render.last_seq) == (5, 7, 5)


@BOTH
def test_preempted_tile_is_cut_in_four(table: Targets) -> None:
    table.add_target()
    first, *others = table.tasks()
    quarters = table.tasks((first, Preempted(2.0)), *((task, DONE) for task in others))
    assert [task.tile for task in quarters] == [  # type: ignore[union-attr]
        Tile(1, 0, 0, 16, 16),
        Tile(5, 16, 0, 32, 16),
        Tile(6, 0, 16, 16, 32),
        Tile(7, 16, 16, 32, 32),
    ]
    # A result of the whole tile does not count any more.
    assert table.tasks((first, DONE)) == []
    (task,) = table.tasks(*((task, DONE) for task in quarters))
    assert isinstance(task, AdvanceTask)
    assert sorted(part.tile.index for part in task.parts) == [1, 2, 3, 4, 5, 6, 7]
    assert table.served() == {"local": pytest.approx(2.0 + 7 * DONE.cpu_seconds)}
    render = table.render()
    assert (render.done_steps, render.total_steps) == (7, 7)
    assert render.cpu_seconds == pytest.approx(2.0 + 7 * DONE.cpu_seconds)


@BOTH
def test_last_pass_ends_the_job(table: Targets) -> None:
    table.add_target()
    assert table.tasks((table.merging(), advanced(final=True))) == []
    render = table.render()
    assert (render.state, render.image_sha256, rows.share(render)) == (JobState.SUCCEEDED, "ab", 1.0)
    assert render.done_steps == render.total_steps == render.last_seq


def test_pass_is_reported_with_all_before_it(table: Targets) -> None:
    table.add_target()
    table.merge(advanced(2, 3))
    table.merge(advanced(1))
    alone = [(past["tiles"], past["cpu_seconds"], past["rays"]) for past in table.render().merges]
    assert alone == [(4, 4 * 0.5 + 0.25, {"camera": 40}), (2, 2 * 0.5 + 0.25, {"camera": 20})]
    first, second = progress.finished_passes(table.render())
    assert [(each["cpu_seconds"], each["rays"], each["error"]) for each in (first, second)] == [
        (2.25, {"camera": 40}, ERROR),
        (3.5, {"camera": 60}, ERROR),
    ]
    assert 0 < first["seconds"] < second["seconds"]


def test_share_stays_when_a_pass_is_added(table: Targets) -> None:
    table.add_target()
    task = table.merging()
    # Forty of a hundred samples are taken; a thousand more are requested.
    assert table.share() == 0.4
    # Of 2.25 CPU seconds that are spent, 1 for the pass, and 100 for what follows, less than 0.4 is done.
    table.tasks((task, advanced(1, 2, samples=1000, later=100.0)), room=0)
    assert table.share() == 0.4
    table.merging()
    assert table.share() == pytest.approx(0.4, abs=1e-6)


def test_share_is_that_of_cpu_seconds(table: Targets) -> None:
    table.add_target()
    # 2.25 CPU seconds are spent on the first pass, 1 on the next, 1.75 on all others.
    table.merge(advanced(1, 2, samples=20, later=1.75))
    assert table.share() == pytest.approx(2.25 / 5, rel=1e-12)
    for number, task in enumerate(table.tasks(), 1):
        table.tasks((task, DONE), room=0)
        assert table.share() == pytest.approx((2.25 + 0.5 * number) / 5, rel=1e-3)


def test_merge_is_tried_again_after_a_crash(table: Targets) -> None:
    table.add_target()
    first = table.merging()
    (second,) = table.release(table.round((first, WorkerDied()))).tasks
    assert isinstance(second, AdvanceTask)
    assert (second.pass_, second.parts, second.attempt) == (first.pass_, first.parts, 2)
    table.tasks((first, advanced(1, 2, 3)), room=0)
    assert table.render().merges == []
    table.tasks((second, advanced(2)), room=0)
    assert [past["attempt"] for past in table.render().merges] == [2]
    # What one pass has cost does not count in the next, and that may cost three workers and no more.
    task: JobTask = table.merging()
    for _ in range(1, MAX_ATTEMPTS):
        (task,) = table.release(table.round((task, WorkerDied()))).tasks
    assert table.render().state is JobState.RUNNING
    assert table.tasks((task, WorkerDied())) == []
    assert table.render().state is JobState.FAILED


@BOTH
def test_restart_merges_a_pass_again(table: Targets) -> None:
    table.add_target()
    table.merge(advanced(2, 3))
    lost = table.merging()
    table.restart()
    (again,) = table.tasks()
    assert isinstance(again, AdvanceTask)
    assert (again.pass_, again.parts, again.attempt) == (lost.pass_, lost.parts, lost.attempt + 1)
    # The answer of the database was lost, so the same is reported once more.
    for _ in range(2):
        table.tasks((again, advanced(1)), room=0)
    table.merge(advanced(final=True))
    assert [past["attempt"] for past in table.render().merges] == [1, 3, 4]
    assert table.render().final_prefix == "4-"


@BOTH
def test_spent_time_ends_with_the_finished_tiles(table: Targets) -> None:
    table.add_target(time_limit=10)
    table.merge(advanced(1, 2, 3, 4))
    running, unstarted = table.tasks(room=2)
    table.spend(11)
    # One runs, one had not begun when its turn came.
    (task,) = table.tasks((running, DONE), (unstarted, Interrupted(late=True)))
    assert not table.retries
    assert isinstance(task, AdvanceTask)
    assert task.last
    assert [part.tile.index for part in task.parts] == [1]
    table.tasks((task, advanced(final=True)))
    render = table.render()
    assert render.state is JobState.SUCCEEDED
    assert render.done_steps == render.total_steps == render.last_seq == 4 + 1 + 1 + 1


@BOTH
def test_late_tile_of_a_job_with_time_left_is_held_back(table: Targets) -> None:
    table.add_target(time_limit=1000)
    table.merge(advanced(1, 2))
    late, _ = table.tasks(room=2)
    assert isinstance(late, SampleTask)
    result = table.round((late, Interrupted(late=True)), room=8)
    assert (result.tasks, [task for task, _ in result.held]) == ([], [late])
    (again,) = table.release(result, room=8).tasks
    assert isinstance(again, SampleTask)
    assert (again.tile, again.attempt) == (late.tile, late.attempt + 1)


def test_first_pass_is_rendered_however_short_the_time_is(table: Targets) -> None:
    table.add_target(time_limit=10)
    first = table.tasks(room=1)
    table.spend(11)
    others = table.tasks()
    assert len(others) == 3
    assert all(isinstance(task, SampleTask) and task.seconds_left is None for task in (*first, *others))
    (task,) = table.tasks(*((task, DONE) for task in (*first, *others)))
    assert isinstance(task, AdvanceTask)
    assert task.last


def test_round_says_when_the_first_time_is_spent(table: Targets) -> None:
    for name, limit in (("a", 4000.0), ("b", 1000.0), ("c", 3000.0)):
        table.add_target(name, time_limit=limit)
    for _ in range(3):
        table.tasks()
    result: Round = table.round()
    assert result.deadline_in is not None
    assert 0 < result.deadline_in <= 1000


def test_tiles_leave_time_to_merge(table: Targets) -> None:
    """0.25 and 2 seconds for the first two passes; of 4 seconds a quarter is the most."""
    table.add_target(time_limit=100)
    table.merge(advanced(1, 2))
    table.merge(advanced(1, 2, merging=2.0))
    render = table.render()
    for limit, reserved in ((100.0, 2.0), (4.0, 1.0)):
        render.time_limit = limit
        whole, tiles = adaptive_passes.time_left(render), adaptive_passes.tile_time_left(render)
        assert whole is not None
        assert tiles is not None
        assert whole - tiles == pytest.approx(reserved, abs=0.1)


def test_share_with_a_time_limit_is_at_least_that_of_the_time(table: Targets) -> None:
    table.add_target(time_limit=10)
    table.merge(advanced(1, 2, samples=20, later=1000.0))
    table.spend(6)
    render = table.render()
    assert progress.share(render) == pytest.approx(0.6, abs=0.05)
    left = progress.remaining_seconds(render)
    assert left is not None
    assert 3 < left <= 4
    table.spend(11)
    assert progress.share(table.render()) < 1
    assert progress.remaining_seconds(table.render()) == 0


def test_remaining_time_is_that_of_the_newest_forecast(table: Targets) -> None:
    """The share never falls, but what is left may grow: seconds for each CPU second are as until now."""
    table.add_target()
    rough = Forecast(next=1.0, later=1.0, deviation=0.85)
    table.merge(replace(advanced(1, 2), expected=rough))
    table.spend(6)
    assert progress.remaining_seconds(table.render()) is None
    for later in (1.0, 8.0):
        table.merge(advanced(1, 2, later=later))
        render = table.render()
        pace = rows.ran_for(render) / render.cpu_seconds
        assert progress.remaining_seconds(render) == pytest.approx((1 + later) * pace, rel=0.1)


def test_share_is_one_only_with_the_picture() -> None:
    # All samples are there, and the picture is being assembled.
    render = RenderRow(state=JobState.RUNNING, counted_share=0.0, counted_work=0, done_work=9, total_work=9)
    assert progress.share(render) < 1
    render.state = JobState.SUCCEEDED
    assert progress.share(render) == 1


def test_first_pass_grows_to_its_predicted_share() -> None:
    target = TargetQuality(mode="target", error=0.02)
    document = scene(80, 48)
    document["camera"]["lens_radius"] = 0.1
    plan = renderer.compile_scene(document, target)
    outline = outline_of(plan, 2, 32)
    columns = adaptive_passes.begin(outline, target, 32)
    assert len(outline.steps) == 3 * 2
    # With a lens every other pixel of every other row begins with 8 samples.
    rays = 8 * 40 * 24
    expected = forecast(Estimate.begin(plan), usual_prices(plan))
    share = expected.next / (expected.next + expected.later)
    assert rays / columns["total_work"] == pytest.approx(share, rel=1e-3)
