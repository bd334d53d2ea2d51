"""Tasks are held back before their next attempt, counted, and have less time left."""

from schemas.tiles import Tile
from service.dispatch.holding import HeldTasks
from service.telemetry.metrics import Metrics
from service.workers.tasks import Interrupted, SampleTask, after, pass_of


def task(seconds_left: float | None = 10.0) -> SampleTask:
    return SampleTask(
        "a", "", Tile(1, 0, 0, 8, 8), pass_of(1), attempt=1, merged=1, seconds_left=seconds_left
    )


def test_task_that_has_waited_has_less_time_left() -> None:
    waited = after(task(), 4.0)
    assert isinstance(waited, SampleTask)
    assert waited.seconds_left == 6.0
    without = task(None)
    assert after(without, 4.0) is without


def test_held_task_is_released_when_its_time_has_passed_or_its_render_is_leaving() -> None:
    now = 100.0
    held = HeldTasks(lambda: now)
    first, second, third = task(), task(), task()
    held.hold(first, 8.0)
    held.hold(second, 2.0)
    assert (list(held.release()), held.seconds_left()) == ([], 2.0)
    now += 2.0
    assert (list(held.release()), held.seconds_left()) == ([second], 6.0)
    assert list(held.release({"b"})) == []
    assert list(held.release({"a"})) == [first]
    held.hold(third, 1.0)
    assert (held.forget(), held.seconds_left()) == ({third}, None)


def test_late_tiles_are_counted() -> None:
    metrics = Metrics()
    metrics.note(task(), Interrupted(late=True))
    metrics.note(task(), Interrupted())
    assert metrics.registry.get_sample_value("penumbra_late_tiles_total") == 1
