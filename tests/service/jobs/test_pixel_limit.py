"""Limit and order of the pixels that are encoded at once."""

import asyncio
from collections.abc import Sequence

import pytest

from service.jobs.request_limits import PixelLimit

MOST = 640
"""Pictures of up to 10 pixels are small."""


async def encoded(wanted: Sequence[tuple[str, int]], cancelled: int | None = None) -> tuple[list[int], int]:
    """The order in which pictures of users get room, and the most pixels that have had it at once."""
    limit = PixelLimit(MOST)
    begun: list[int] = []
    now = most = 0

    async def encode(place: int, user: str, pixels: int) -> None:
        nonlocal now, most
        async with limit.room(user, pixels):
            begun.append(place)
            now += pixels
            most = max(most, now)
            try:
                # Others have their turn many times meanwhile.
                for _ in range(20):
                    await asyncio.sleep(0)
            finally:
                now -= pixels

    tasks = [asyncio.create_task(encode(place, *one)) for place, one in enumerate(wanted)]
    if cancelled is not None:
        await asyncio.sleep(0)
        tasks[cancelled].cancel()
    await asyncio.wait_for(asyncio.gather(*tasks, return_exceptions=True), timeout=60)
    return begun, most


def test_pictures_of_one_user_leave_room_for_those_of_others() -> None:
    begun, most = asyncio.run(encoded([("ann", MOST)] * 4 + [("bob", MOST)] * 2 + [("cy", 100)]))
    # The first is at work, and then they come in turns.
    assert begun == [0, 6, 1, 4, 2, 5, 3]
    assert most == MOST


def test_small_picture_waits_for_no_large_one() -> None:
    begun, most = asyncio.run(encoded([("ann", 3 * MOST), ("ann", MOST), ("bob", 10)]))
    assert begun == [0, 2, 1]
    assert most == 3 * MOST + 10


@pytest.mark.parametrize("cancelled", [0, 1, 2])
def test_request_that_ends_early_leaves_its_room(cancelled: int) -> None:
    wanted = [("ann", MOST), ("ann", MOST), ("bob", MOST), ("ann", 100)]
    begun, most = asyncio.run(encoded(wanted, cancelled))
    assert {0, 1, 2, 3} - {cancelled} <= set(begun)
    assert most == MOST
