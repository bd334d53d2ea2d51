"""How many pixels are encoded at once."""

from __future__ import annotations

import asyncio

import pytest

from service.jobs.limits import PixelLimit

MOST = 10


async def encoded(wanted: list[int], cancelled: int | None = None) -> tuple[list[int], int]:
    """The order in which pictures of these sizes get room, and the most pixels that have had it at once."""
    limit = PixelLimit(MOST)
    begun: list[int] = []
    now = most = 0

    async def encode(place: int, pixels: int) -> None:
        nonlocal now, most
        async with limit.room(pixels):
            begun.append(place)
            now += pixels
            most = max(most, now)
            try:
                # Others have their turn many times meanwhile.
                for _ in range(20):
                    await asyncio.sleep(0)
            finally:
                now -= pixels

    tasks = [asyncio.create_task(encode(*one)) for one in enumerate(wanted)]
    if cancelled is not None:
        await asyncio.sleep(0)
        tasks[cancelled].cancel()
    await asyncio.wait_for(asyncio.gather(*tasks, return_exceptions=True), timeout=60)
    return begun, most


def test_pictures_have_room_in_the_order_of_their_requests() -> None:
    begun, most = asyncio.run(encoded([4, 4, 9, 1, 1, 1]))
    assert begun == [0, 1, 2, 3, 4, 5]
    assert most <= MOST


def test_picture_larger_than_the_room_is_encoded_alone() -> None:
    begun, most = asyncio.run(encoded([3, 3 * MOST, 3]))
    assert begun == [0, 1, 2]
    assert most == 3 * MOST


@pytest.mark.parametrize("cancelled", [0, 1, 2])
def test_request_that_ends_early_leaves_its_room(cancelled: int) -> None:
    begun, most = asyncio.run(encoded([MOST, MOST, MOST, 1], cancelled))
    assert begun[-1] == 3
    assert most == MOST
