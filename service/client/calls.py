"""Every request to the service, built in one place, with the function that reads its answer.

Nothing here sends anything: both clients, and any of another kind (recorded, batched), use the same calls.
"""

from __future__ import annotations

import json
import secrets
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace
from typing import Any, Generic, TypeVar
from urllib.parse import quote

import httpx2
from pydantic import BaseModel, ValidationError

from schemas.batches import MEDIA_TYPE
from schemas.comparisons import ComparisonAnswer
from schemas.convergence import Convergence
from schemas.jobs import Asset, Job, JobList, TileBatch, TileEvent, Version
from schemas.logs import JobLog
from schemas.plans import PlanDocument
from schemas.quotes import Quote
from schemas.request_pointers import in_scene
from schemas.retention import Pruned
from schemas.traces import TraceAnswer
from service.client.batches import Encoding, PixelBatch, decode_batch
from service.client.errors import UnexpectedAnswerError
from service.client.pictures import Picture, PictureKind, read_picture

LONGEST_PAGE = 100
"""Jobs that a service tells at once, at most."""

Answer = TypeVar("Answer")
Model = TypeVar("Model", bound=BaseModel)


@dataclass(frozen=True, slots=True)
class Call(Generic[Answer]):
    """One request and how its answer is read.

    Attributes
    ----------
    repeatable
        Sending it twice does the same as sending it once.
    may_be_missing
        404 is an answer like any other and not an error.
    hold
        Seconds for which the server may hold back its answer.
    job_id
        The job it is about; a time-out names it.
    """

    method: str
    path: str
    read: Callable[[httpx2.Response], Answer]
    params: Mapping[str, str | list[str]] = field(default_factory=dict)
    headers: Mapping[str, str] = field(default_factory=dict)
    content: bytes | None = None
    repeatable: bool = True
    may_be_missing: bool = False
    hold: float = 0.0
    job_id: str | None = None

    def request(self, timeout: float) -> dict[str, Any]:
        """The arguments of ``request`` of an HTTP client of either kind; `timeout` in seconds."""
        return {
            "method": self.method,
            "url": self.path,
            "params": dict(self.params),
            "headers": dict(self.headers),
            "content": self.content,
            "timeout": timeout + self.hold,
        }


def has_asset(sha256: str) -> Call[bool]:
    """Whether the server has this content already."""
    path = f"/v1/assets/{sha256}"
    return Call("HEAD", path, lambda answer: answer.status_code != 404, may_be_missing=True)


def put_asset(sha256: str, content: bytes) -> Call[Asset]:
    """Store a content under its SHA-256, in hexadecimal digits."""
    headers = {"Content-Type": "application/octet-stream"}
    return Call("PUT", f"/v1/assets/{sha256}", _model(Asset), headers=headers, content=content)


def submit_job(
    body: Mapping[str, Any], *, wait: float = 0.0, key: str | None = None, anew: bool = False
) -> Call[Job]:
    """Ask for a render. The same key makes the same request the same job, however often it is sent."""
    headers = {"Idempotency-Key": key or secrets.token_hex(16)}
    headers |= {"Prefer": f"wait={wait:g}"} if wait > 0 else {}
    headers |= {"Cache-Control": "no-cache"} if anew else {}
    return _post("/v1/jobs", body, Job, headers=headers, hold=wait)


def get_job(job_id: str) -> Call[Job]:
    """The job as it is now."""
    return Call("GET", _job_path(job_id), _model(Job), job_id=job_id)


def list_jobs(
    *,
    limit: int,
    cursor: str | None = None,
    state: str | None = None,
    labels: Mapping[str, str] | None = None,
) -> Call[JobList]:
    """One page of jobs, newest first, of those in a state and with all these labels."""
    params: dict[str, str | list[str]] = {"limit": str(limit)}
    params |= {name: text for name, text in (("cursor", cursor), ("state", state)) if text}
    params["label"] = [f"{name}:{value}" for name, value in (labels or {}).items()]
    return Call("GET", "/v1/jobs", _model(JobList), params=params)


def cancel_job(job_id: str) -> Call[Job]:
    """Stop a job; a job that has ended stays as it is."""
    return Call("POST", _job_path(job_id) + "/cancel", _model(Job), job_id=job_id)


def pause_job(job_id: str) -> Call[Job]:
    """Pause a job; a job that has ended stays as it is."""
    return Call("POST", _job_path(job_id) + "/pause", _model(Job), job_id=job_id)


def resume_job(job_id: str) -> Call[Job]:
    """Resume a paused job."""
    return Call("POST", _job_path(job_id) + "/resume", _model(Job), job_id=job_id)


def delete_job(job_id: str) -> Call[None]:
    """Remove a job and its image."""
    return Call("DELETE", _job_path(job_id), lambda _: None, repeatable=False, job_id=job_id)


def pin_job(job_id: str, *, pinned: bool) -> Call[Job]:
    """Keep the picture of a job, or let it go when its time has come."""
    return Call("PUT" if pinned else "DELETE", _job_path(job_id) + "/pin", _model(Job), job_id=job_id)


def prune(body: Mapping[str, Any]) -> Call[Pruned]:
    """Delete what the rules do not keep, or report what that would be."""
    return _post("/v1/prune", body, Pruned)


def get_tiles(job_id: str, *, after: int, wait: float) -> Call[TileBatch]:
    """The tile events after a number; with `wait` the server holds the answer until there is one."""
    return _tiles(job_id, after, wait, "application/json", _model(TileBatch))


def get_tile_pixels(job_id: str, *, after: int, wait: float, encoding: Encoding) -> Call[PixelBatch]:
    """The same with the pixels of all these tiles."""
    call = _tiles(job_id, after, wait, MEDIA_TYPE, lambda answer: decode_batch(answer.content))
    return replace(call, params={**call.params, "encoding": encoding})


def get_events(job_id: str, *, after: int) -> Call[httpx2.EventSource]:
    """The tile events after a number as a stream; its answer must be sent as one."""
    headers = {"Accept": "text/event-stream", "Last-Event-ID": str(after)}
    return Call("GET", _job_path(job_id) + "/events", httpx2.EventSource, headers=headers, job_id=job_id)


def tile_event(event: httpx2.ServerSentEvent) -> TileEvent | None:
    """The tile event in an event of that stream; None for an event of another kind."""
    if event.event != "tile":
        return None
    try:
        return TileEvent.model_validate_json(event.data)
    except ValidationError as error:
        raise UnexpectedAnswerError("The server sent an event that is not a tile.") from error


def get_picture(job_id: str, kind: PictureKind) -> Call[Picture]:
    """The image, or what there is of it while the job is running."""
    return Call("GET", _job_path(job_id) + f"/image.{kind}", read_picture, job_id=job_id)


def get_glimpse(job_id: str) -> Call[bytes | None]:
    """The bytes of a PNG of what there is of the image; None while that is nothing, which is no error."""

    def read(answer: httpx2.Response) -> bytes | None:
        return answer.content if answer.is_success else None

    return Call("GET", _job_path(job_id) + "/image.png", read, may_be_missing=True, job_id=job_id)


def get_layer(job_id: str, name: str) -> Call[Picture]:
    """A layer that the job was asked for, or what there is of it while the job is running."""
    path = _job_path(job_id) + f"/layers/{quote(name, safe='')}.npy"
    return Call("GET", path, read_picture, job_id=job_id)


def get_plan(job_id: str) -> Call[PlanDocument]:
    """What runs for a job, and who asked."""
    read = _model(PlanDocument)
    return Call("GET", _job_path(job_id) + "/plan", lambda answer: in_scene(read(answer)), job_id=job_id)


def get_convergence(job_id: str) -> Call[Convergence]:
    """What its passes have cost and which error they left, so far."""
    return Call("GET", _job_path(job_id) + "/convergence", _model(Convergence), job_id=job_id)


def get_convergence_file(job_id: str, form: str) -> Call[bytes]:
    """The same as a file: json, csv, svg or png."""
    path = _job_path(job_id) + "/convergence"
    return Call("GET", path, lambda answer: answer.content, params={"format": form}, job_id=job_id)


def get_log(job_id: str) -> Call[JobLog]:
    """What became of a job."""
    return Call("GET", _job_path(job_id) + "/log", _model(JobLog), job_id=job_id)


def make_plan(body: Mapping[str, Any]) -> Call[PlanDocument]:
    """What would run for a scene."""
    return _post("/v1/plans", body, PlanDocument)


def make_quote(body: Mapping[str, Any]) -> Call[Quote]:
    """Ask what a scene would cost."""
    return _post("/v1/quotes", body, Quote)


def trace(body: Mapping[str, Any]) -> Call[TraceAnswer]:
    """Cast rays without a job."""
    return _post("/v1/traces", body, TraceAnswer)


def make_comparison(body: Mapping[str, Any]) -> Call[ComparisonAnswer]:
    """Compare two pictures."""
    return _post("/v1/comparisons", body, ComparisonAnswer)


def get_version() -> Call[Version]:
    """Which service this is."""
    return Call("GET", "/version", _model(Version))


def _job_path(job_id: str) -> str:
    # An address with any of these for an id is that of something else.
    if str(job_id) != job_id or job_id in {"", ".", ".."}:
        raise ValueError(f"The id of a job is text, such as '3d27fc65e075c8d5', not {job_id!r}.")
    return f"/v1/jobs/{quote(job_id, safe='')}"


def _post(
    path: str,
    body: Mapping[str, Any],
    model: type[Model],
    *,
    headers: Mapping[str, str] | None = None,
    hold: float = 0.0,
) -> Call[Model]:
    content = json.dumps(body, allow_nan=False, separators=(",", ":")).encode()
    return Call(
        "POST",
        path,
        _model(model),
        headers={"Content-Type": "application/json", **(headers or {})},
        content=content,
        hold=hold,
    )


def _tiles(
    job_id: str, after: int, wait: float, accept: str, read: Callable[[httpx2.Response], Answer]
) -> Call[Answer]:
    params = {"after": str(after), "wait": f"{wait:g}"}
    path = _job_path(job_id) + "/tiles"
    return Call("GET", path, read, params=params, headers={"Accept": accept}, hold=wait, job_id=job_id)


def _model(model: type[Model]) -> Callable[[httpx2.Response], Model]:
    def read(answer: httpx2.Response) -> Model:
        try:
            return model.model_validate_json(answer.content)
        except ValidationError as error:
            raise UnexpectedAnswerError(f"{answer.url} did not answer with a {model.__name__}.") from error

    return read
