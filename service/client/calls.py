"""Requests to the service, each with the function that reads its response. Nothing here sends anything."""

from __future__ import annotations

import json
import secrets
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any, Generic, TypeVar
from urllib.parse import quote

import httpx2
from pydantic import BaseModel, ValidationError

from schemas.api.batches import MEDIA_TYPE
from schemas.api.jobs import Asset, Job, JobList, TileBatch, TileEvent
from service.client.batches import Encoding, PixelBatch, decode_batch
from service.client.errors import UnexpectedAnswerError
from service.client.pictures import Picture, read_picture

LONGEST_PAGE = 100
"""Most jobs in one answer of a service."""
LONGEST_WAIT = 3600.0
"""Most seconds that a service holds an answer back."""
LONGEST_SECONDS = 1e9
"""Three decades; the system takes no timeouts that are much longer."""

Labels = Mapping[str, str | Sequence[str]]
"""Names of labels, each with its wanted value or values: a job has one of them."""

Answer = TypeVar("Answer")
Model = TypeVar("Model", bound=BaseModel)


def checked_seconds(name: str, seconds: float | None) -> float | None:
    """The seconds that something may last; None is for ever.

    Raises
    ------
    ValueError
        They are negative, or no number.
    """
    if seconds is not None and not seconds >= 0:
        raise ValueError(f"{name} is a number of seconds, at least 0, or None for ever, not {seconds!r}.")
    return None if seconds is None or seconds > LONGEST_SECONDS else seconds


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
        The job it is about; a timeout names it.
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

    def request(self, timeout: float | None) -> dict[str, Any]:
        """The arguments of ``request`` of an HTTP client of either kind; `timeout` is None for ever."""
        return {
            "method": self.method,
            "url": self.path,
            "params": dict(self.params),
            "headers": dict(self.headers),
            "content": self.content,
            "timeout": None if timeout is None else timeout + self.hold,
        }


def ask(path: str, model: type[Model], params: Mapping[str, str | list[str]] | None = None) -> Call[Model]:
    """Ask for a document."""
    return Call("GET", path, _model(model), params=params or {})


def about(job_id: str, part: str, model: type[Model], method: str = "GET") -> Call[Model]:
    """Ask about a job, or change it; `part` is what follows the job's own path, such as ``/plan``."""
    return Call(method, job_path(job_id) + part, _model(model), job_id=job_id)


def post(
    path: str,
    body: Mapping[str, Any],
    model: type[Model],
    *,
    headers: Mapping[str, str] | None = None,
    hold: float = 0.0,
) -> Call[Model]:
    """Send a JSON body."""
    content = json.dumps(body, allow_nan=False, separators=(",", ":")).encode()
    headers = {"Content-Type": "application/json", **(headers or {})}
    return Call("POST", path, _model(model), headers=headers, content=content, hold=hold)


def job_path(job_id: str) -> str:
    """The path of a job.

    Raises
    ------
    ValueError
        With this id it would be the path of something else.
    """
    if str(job_id) != job_id or job_id in {"", ".", ".."}:
        raise ValueError(f"The id of a job is text, such as '3d27fc65e075c8d5', not {job_id!r}.")
    return f"/v1/jobs/{quote(job_id, safe='')}"


def has_asset(sha256: str) -> Call[bool]:
    """Whether the server has this content already."""
    path = f"/v1/assets/{sha256}"
    return Call("HEAD", path, lambda answer: answer.status_code != 404, may_be_missing=True)


def put_asset(sha256: str, content: bytes) -> Call[Asset]:
    """Store a content under its SHA-256, in hexadecimal digits."""
    headers = {"Content-Type": "application/octet-stream"}
    return Call("PUT", f"/v1/assets/{sha256}", _model(Asset), headers=headers, content=content)


def submit_job(body: Mapping[str, Any], *, wait: float | None, key: str | None, anew: bool) -> Call[Job]:
    """Submit a job. The same request with the same key is the same job."""
    wait = checked_seconds("wait", wait)
    wait = LONGEST_WAIT if wait is None else min(wait, LONGEST_WAIT)
    headers = {"Idempotency-Key": key or secrets.token_hex(16)}
    headers |= {"Prefer": f"wait={wait:g}"} if wait > 0 else {}
    headers |= {"Cache-Control": "no-cache"} if anew else {}
    return post("/v1/jobs", body, Job, headers=headers, hold=wait)


def list_jobs(
    *, limit: int, cursor: str | None, state: str | None, labels: Labels | None, search: str | None
) -> Call[JobList]:
    """One page of jobs, newest first: those in a state, with a value of each label, and with a text."""
    given = {"limit": str(limit), "cursor": cursor, "state": state, "search": search}
    params: dict[str, str | list[str]] = {name: text for name, text in given.items() if text}
    wanted = {name: [one] if isinstance(one, str) else one for name, one in (labels or {}).items()}
    params["label"] = [f"{name}:{value}" for name, values in wanted.items() for value in values]
    return ask("/v1/jobs", JobList, params)


def delete_job(job_id: str) -> Call[None]:
    """Remove a job and its image."""
    return Call("DELETE", job_path(job_id), lambda _: None, repeatable=False, job_id=job_id)


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
    return Call("GET", job_path(job_id) + "/events", httpx2.EventSource, headers=headers, job_id=job_id)


def tile_event(event: httpx2.ServerSentEvent) -> TileEvent | None:
    """The tile event of an event of that stream; None for other kinds."""
    if event.event != "tile":
        return None
    try:
        return TileEvent.model_validate_json(event.data)
    except ValidationError as error:
        raise UnexpectedAnswerError("The server sent an event that is not a tile.") from error


def get_picture(job_id: str, *names: str) -> Call[Picture]:
    """A file of the image or of a layer; while the job runs, the finished part of it."""
    path = "/".join([job_path(job_id), *(quote(name, safe="") for name in names)])
    return Call("GET", path, read_picture, job_id=job_id)


def get_preview(job_id: str) -> Call[bytes | None]:
    """A PNG of the finished part of the image; None before its first tile."""

    def read(answer: httpx2.Response) -> bytes | None:
        return answer.content if answer.is_success else None

    return Call("GET", job_path(job_id) + "/image.png", read, may_be_missing=True, job_id=job_id)


def get_convergence_file(job_id: str, form: str) -> Call[bytes]:
    """The convergence of a job as a file: json, csv, svg or png."""
    path = job_path(job_id) + "/convergence"
    return Call("GET", path, lambda answer: answer.content, params={"format": form}, job_id=job_id)


def _tiles(
    job_id: str, after: int, wait: float, accept: str, read: Callable[[httpx2.Response], Answer]
) -> Call[Answer]:
    params = {"after": str(after), "wait": f"{wait:g}"}
    path = job_path(job_id) + "/tiles"
    return Call("GET", path, read, params=params, headers={"Accept": accept}, hold=wait, job_id=job_id)


def _model(model: type[Model]) -> Callable[[httpx2.Response], Model]:
    def read(answer: httpx2.Response) -> Model:
        try:
            return model.model_validate_json(answer.content)
        except ValidationError as error:
            raise UnexpectedAnswerError(f"{answer.url} did not answer with a {model.__name__}.") from error

    return read
