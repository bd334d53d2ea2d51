"""Tile events of a job by number, with or without pixels, polled or pushed."""

from __future__ import annotations

from collections.abc import AsyncIterator
from typing import Annotated, Any, Literal

from fastapi import APIRouter, Depends, Header, Query, Request
from fastapi.concurrency import run_in_threadpool
from fastapi.responses import Response
from fastapi.sse import EventSourceResponse, format_sse_event

from schemas.api import batches
from schemas.api.jobs import Job, JobState, TileBatch, TileEvent
from service.api.authentication import CurrentUser, JobId, authenticate, claimant_of
from service.api.bodies import while_connected
from service.api.middleware import end_turn
from service.api.request_headers import check_preconditions
from service.api.routes.parameters import BINARY, After, Wait, negotiate, problem
from service.api.routes.stored import streamed
from service.errors import DamagedJobError, KeyExpiredError, UnauthenticatedError, UnknownJobError
from service.jobs import lifecycle as jobs
from service.jobs import tile_events
from service.jobs.context import Here, Service
from service.storage.objects import Stored

router = APIRouter(prefix="/v1/jobs/{job_id}", tags=["tiles"])

Encoding = Annotated[
    Literal["float32", "float16", "rgb8"],
    Query(
        description="Pixels of a binary batch: linear RGB in float32 or float16, or displayed RGB in 8 bits."
    ),
]
LastEventId = Annotated[
    int | None, Header(ge=0, le=2**31 - 1, description="Number of the last event received.")
]

FORMS = ("application/json", batches.MEDIA_TYPE)
TILES: dict[int | str, dict[str, Any]] = {
    200: {
        "description": "The events after `after`, as JSON, or with their pixels as a binary batch.",
        "model": TileBatch,
        "content": {batches.MEDIA_TYPE: BINARY},
    },
    304: {"description": "You have this batch of a final picture already, by `If-None-Match`."},
}


BATCH_WEIGHT = 4
"""A pixel of a batch takes up to 4 times the memory of one of a PNG file while it is encoded."""
BATCH_FORM = (batches.__doc__ or "").partition("\n\n")[2].partition("\n\n>>>")[0]
DAMAGED = problem(410, "The stored picture is damaged: submit the job again.", "picture_damaged")
UNKNOWN = problem(404, "There is no such job.", "unknown_job")
EVENT = {name: {"type": "string"} for name in ("event", "id", "data")}
EVENTS: dict[int | str, dict[str, Any]] = {
    200: {"content": {"text/event-stream": {"itemSchema": {"type": "object", "properties": EVENT}}}}
}
STREAMED = {"Cache-Control": "no-cache", "X-Accel-Buffering": "no"}
"""Caches keep nothing of a stream, and nginx holds nothing of it back."""
CROWDED = problem(429, "You have too many concurrent event streams.", "busy")


@router.get(
    "/tiles",
    response_model=None,
    responses=TILES | UNKNOWN | DAMAGED | CROWDED,
    summary="List tile events",
    description="List the events of finished tiles after a number. With `wait` the response comes as soon as "
    "there is one.\n`complete` is true when the job has ended and no event follows.\n\n"
    "`Accept: application/octet-stream` returns the pixels in a binary batch.\n" + BATCH_FORM,
)
async def get_tiles(
    here: Here,
    request: Request,
    response: Response,
    user: CurrentUser,
    job_id: JobId,
    after: After = 0,
    wait: Wait = 0.0,
    encoding: Encoding = "float32",
) -> TileBatch | Response:
    """List tile events by number."""
    if wait:
        await end_turn(request.scope)
        with here.streams.waiting(user):
            seconds = min(wait, here.settings.max_wait_seconds)
            news = jobs.until(here, job_id, seconds, lambda job: job.last_seq > after or job.state.final)
            await while_connected(request, news)
        # The key may have been revoked meanwhile.
        await authenticate(request, here)
    response.headers["Vary"] = "Accept"
    if negotiate(request, FORMS) != batches.MEDIA_TYPE:
        return await run_in_threadpool(tile_events.batch, here, job_id, after)
    form = tile_events.ENCODINGS[encoding]
    headers = {"Vary": "Accept"}
    if tag := await run_in_threadpool(tile_events.etag, here, job_id, after, form):
        headers |= {"ETag": tag, "Cache-Control": "no-cache"}
        unchanged = check_preconditions(request, headers)
        if unchanged is not None:
            return unchanged
    batch = await while_connected(request, _pixel_batch(here, request, job_id, after, form))
    return await run_in_threadpool(streamed, 200, batch, (0, batch.size), batches.MEDIA_TYPE, headers)


async def _pixel_batch(service: Service, request: Request, job_id: str, after: int, form: int) -> Stored:
    news = await run_in_threadpool(tile_events.batch, service, job_id, after)
    await end_turn(request.scope)
    pixels = BATCH_WEIGHT * tile_events.pixels_of(news.events)
    async with service.encoding.room(claimant_of(request), pixels):
        return await run_in_threadpool(tile_events.pixel_batch, service, job_id, after, form)


async def known(here: Here, job_id: JobId) -> Job:
    """Answer 404 for an unknown job before a stream has begun."""
    return await run_in_threadpool(jobs.show, here, job_id)


async def watching(here: Here, user: CurrentUser, job: Annotated[Job, Depends(known)]) -> AsyncIterator[Job]:
    """Count a stream from before its beginning to its end; too many are answered 429."""
    with here.streams.waiting(user):
        yield job


@router.head("/events", include_in_schema=False)
async def events_exist(job: Annotated[Job, Depends(known)]) -> Response:  # noqa: ARG001
    """Answer without waiting: the stream lasts as long as the job."""
    return Response(media_type="text/event-stream")


@router.get(
    "/events",
    response_class=Response,
    responses=EVENTS | UNKNOWN | CROWDED,
    summary="Stream tile events",
    response_description="A stream of events, until the job ends.",
)
async def get_events(
    here: Here, request: Request, job: Annotated[Job, Depends(watching)], last_event_id: LastEventId = None
) -> Response:
    """Stream the events of finished tiles as Server-Sent Events: the same as `/tiles` returns.

    Each event `tile` has its number as id; the event `end` has the job, and ends the stream. A job that is
    deleted meanwhile ends as cancelled. After a broken connection, send the number of the last event in
    `Last-Event-ID`. A comment every 10 seconds keeps an idle connection open.
    """
    # The framework's own streams end with an error where a client leaves that has not read everything.
    return EventSourceResponse(_events(here, request, job, last_event_id or 0), headers=STREAMED)


async def _is_admitted(request: Request, here: Here) -> bool:
    """Whether the key or the session of a request is still good: a stream may outlive both."""
    try:
        await authenticate(request, here)
    except (UnauthenticatedError, KeyExpiredError):
        return False
    return True


async def _events(here: Here, request: Request, job: Job, after: int) -> AsyncIterator[bytes]:
    with here.job_events.watch(job.id) as watcher:
        while await _is_admitted(request, here):
            try:
                batch, ended = await run_in_threadpool(tile_events.batch_and_end, here, job.id, after)
            except UnknownJobError:
                yield _end(job if job.state.final else job.model_copy(update={"state": JobState.CANCELLED}))
                return
            except DamagedJobError:
                yield _end(await run_in_threadpool(jobs.show, here, job.id))
                return
            # In one piece: between pieces nothing would notice that the client has left.
            yield b"".join(map(_tile, batch.events))
            after = batch.next
            if ended is not None:
                yield _end(ended)
                return
            more = len(batch.events) == here.settings.max_events
            if not more and not await watcher.wait(here.settings.heartbeat_seconds):
                if here.job_events.closed:
                    return
                yield format_sse_event(comment="still here")


def _tile(event: TileEvent) -> bytes:
    return format_sse_event(event="tile", id=str(event.seq), data_str=event.model_dump_json())


def _end(job: Job) -> bytes:
    return format_sse_event(event="end", data_str=job.model_dump_json())
