"""Events of a job: sent at once to a single watcher, collected for many."""

import asyncio
from contextlib import ExitStack

import pytest

from service.dispatch import job_events
from service.dispatch.job_events import JobEvents

JOB = "a"


async def heard(crowd: int) -> list[int]:
    """Number of times that each of many watchers is woken by two successive events."""
    news = JobEvents()
    with ExitStack() as stack:
        watchers = [stack.enter_context(news.watch(JOB)) for _ in range(crowd)]
        waits = [asyncio.create_task(watcher.wait(60.0)) for watcher in watchers]
        for _ in range(2):
            news.publish([JOB])
            # Enough turns of the loop for a watcher that does not collect events.
            for _ in range(10):
                await asyncio.sleep(0)
        first = await asyncio.gather(*waits)
        return [woken + await watcher.wait(0.0) for woken, watcher in zip(first, watchers, strict=True)]


@pytest.mark.parametrize(("crowd", "times"), [(1, 2), (2, 1), (50, 1)])
def test_events_gather_for_a_crowd_and_not_for_one(
    monkeypatch: pytest.MonkeyPatch, crowd: int, times: int
) -> None:
    monkeypatch.setattr(job_events, "EACH_SECONDS", 0.5)
    assert asyncio.run(heard(crowd)) == [times] * crowd


def test_watchers_of_a_service_that_ends_are_woken() -> None:
    async def ended() -> bool:
        news = JobEvents()
        with news.watch(JOB) as watcher, news.watch(JOB):
            news.close()
            return await watcher.wait(60.0)

    assert not asyncio.run(ended())
