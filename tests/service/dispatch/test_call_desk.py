"""The calls desk: whose call is next, how many workers one user's occupy, and who pays."""

from contextlib import ExitStack

import pytest

from service.dispatch.call_desk import CallDesk
from service.errors import BusyError
from service.workers.tasks import CallDone, Interrupted, PlanTask


@pytest.fixture
def desk() -> CallDesk:
    return CallDesk(most=3, workers=4, wake=lambda: None)


def call(user: str) -> PlanTask:
    return PlanTask(user=user, body=b"", workers=1, tile_size=None)


def test_calls_of_one_user_occupy_half_of_the_workers(desk: CallDesk) -> None:
    first, *_ = calls = [call("ann") for _ in range(4)]
    for task in calls:
        desk.ask(task)
    assert list(desk.hand_out(4)) == calls[:2]
    late = call("bob")
    desk.ask(late)
    assert list(desk.hand_out(2)) == [late]
    desk.record(first, CallDone("answer", 0.5))
    assert list(desk.hand_out(2)) == [calls[2]]


def test_next_call_is_of_whoever_has_used_least_and_each_pays(desk: CallDesk) -> None:
    dear, cheap = call("ann"), call("bob")
    for task in (dear, cheap):
        desk.ask(task)
    assert set(desk.hand_out(2)) == {dear, cheap}
    waiting = [call("ann"), call("bob")]
    for task in waiting:
        desk.ask(task)
    desk.record(dear, CallDone("answer", 2.0))
    desk.record(cheap, CallDone("answer", 0.5))
    assert desk.charges == {"ann": 2.0, "bob": 0.5}
    assert list(desk.hand_out(1)) == waiting[1:]


def test_call_of_a_lost_worker_is_asked_again(desk: CallDesk) -> None:
    task = call("ann")
    answer = desk.ask(task)
    assert list(desk.hand_out(1)) == [task]
    desk.record(task, Interrupted())
    assert not answer.done()
    assert list(desk.hand_out(1)) == [task]


def test_calls_beyond_the_limit_are_refused(desk: CallDesk) -> None:
    with ExitStack() as calls:
        for user in ("ann", "ann", "ann", "bob"):
            calls.enter_context(desk.place(user))
        with pytest.raises(BusyError):
            calls.enter_context(desk.place("ann"))
    with desk.place("ann"):
        pass
