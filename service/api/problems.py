"""Error responses: one table from exceptions to statuses, and problem documents (RFC 9457)."""

from __future__ import annotations

import codecs
import sqlite3
from collections.abc import Callable, Sequence
from http import HTTPStatus
from typing import Any, NamedTuple
from urllib.parse import quote

import structlog
from fastapi import FastAPI, Request
from fastapi.exceptions import RequestValidationError
from fastapi.responses import RedirectResponse, Response
from sqlalchemy.exc import DataError, DBAPIError
from sqlalchemy.exc import TimeoutError as PoolTimeoutError
from starlette.exceptions import HTTPException

import renderer
from accuracy.comparison import NotComparableError
from renderer.assets import AssetError, NoSuchAssetError
from renderer.convergence import NothingToFitError
from renderer.errors import ImageFileError, MissingExtraError
from renderer.integrator import OutOfTimeError
from renderer.meshes.obj import ObjError
from schemas.errors import MAX_LISTED, Problem, ProblemDocument
from schemas.limits import LimitsError
from schemas.reading.findings import located
from service import errors, start_errors
from service.jobs.context import Service
from service.lifecycle.damage import DamagedRenderError
from service.storage.database.connection import PRIMARY_CODE
from service.storage.folder import NO_ROOM, NOT_WRITABLE

MEDIA_TYPE = "application/problem+json"
RETRY_AFTER_SECONDS = 1
NOWHERE = "There is nothing at this address. /docs and /openapi.json list the addresses of the service."

log = structlog.get_logger()


class Kind(NamedTuple):
    """Kind of response to an exception.

    ``is_public`` says whether its text is meant for the client; other texts are for the log only.
    """

    status: int
    code: str
    is_public: bool = True
    retry: bool = False


KINDS: dict[type[Exception], Kind] = {
    renderer.SceneError: Kind(422, "scene_not_usable"),
    errors.RefusedError: Kind(422, "scene_not_usable"),
    renderer.RenderError: Kind(500, "render_failed", is_public=False),
    ImageFileError: Kind(500, "picture_failed", is_public=False),
    NotComparableError: Kind(422, "not_comparable"),
    MissingExtraError: Kind(501, "extra_missing"),
    OutOfTimeError: Kind(500, "out_of_time", is_public=False),
    LimitsError: Kind(500, "limits", is_public=False),
    AssetError: Kind(422, "asset_not_usable"),
    NoSuchAssetError: Kind(422, "asset_not_usable"),
    ObjError: Kind(422, "asset_not_usable"),
    NothingToFitError: Kind(422, "nothing_to_fit"),
    errors.ServiceError: Kind(500, "internal", is_public=False),
    errors.RequestError: Kind(400, "bad_request"),
    errors.BodyTooLargeError: Kind(413, "body_too_large"),
    errors.BodyIncompleteError: Kind(400, "body_incomplete"),
    errors.BodySlowError: Kind(408, "body_slow"),
    errors.DisconnectedError: Kind(400, "disconnected"),
    errors.UnknownHostError: Kind(421, "unknown_host"),
    errors.MediaTypeError: Kind(415, "media_type"),
    errors.ParametersError: Kind(422, "parameters"),
    errors.PreconditionFailedError: Kind(412, "precondition_failed"),
    errors.RangeError: Kind(416, "range"),
    errors.UnauthenticatedError: Kind(401, "unauthenticated"),
    errors.KeyExpiredError: Kind(401, "key_expired"),
    errors.UnknownKeyError: Kind(404, "unknown_key"),
    errors.ForbiddenError: Kind(403, "forbidden"),
    errors.CrossSiteError: Kind(403, "cross_site"),
    errors.UnknownJobError: Kind(404, "unknown_job"),
    errors.DamagedJobError: Kind(500, "job_damaged"),
    DamagedRenderError: Kind(500, "job_damaged"),
    errors.ReusedKeyError: Kind(422, "idempotency_key_reused"),
    errors.PictureNotReadyError: Kind(404, "picture_not_ready", retry=True),
    errors.PictureGoneError: Kind(410, "picture_gone"),
    errors.PictureDamagedError: Kind(410, "picture_damaged"),
    errors.UnknownLayerError: Kind(404, "unknown_layer"),
    errors.UnknownAssetError: Kind(404, "unknown_asset"),
    errors.UploadError: Kind(422, "upload"),
    errors.UploadMismatchError: Kind(422, "upload_mismatch"),
    errors.UploadQuotaError: Kind(413, "upload_quota"),
    errors.UploadUnusableError: Kind(422, "upload_unusable"),
    start_errors.NoKeysError: Kind(500, "no_keys", is_public=False),
    start_errors.PortTakenError: Kind(500, "port_taken", is_public=False),
    start_errors.OpenFilesError: Kind(500, "open_files", is_public=False),
    errors.DatabaseUrlError: Kind(500, "database_url", is_public=False),
    errors.DatabaseVersionError: Kind(500, "database_version", is_public=False),
    errors.EngineError: Kind(500, "engine", is_public=False),
    errors.EngineMissingError: Kind(500, "engine_missing", is_public=False),
    errors.UnsafeClusterError: Kind(500, "unsafe_cluster", is_public=False),
    errors.UnusableWorkerError: Kind(500, "unusable_worker", is_public=False),
    errors.StoreError: Kind(500, "store", is_public=False),
    errors.StoreFullError: Kind(507, "store_full", retry=True),
    errors.StoreReadOnlyError: Kind(503, "store_read_only", retry=True),
    errors.StoreAwayError: Kind(503, "store_away", retry=True),
    errors.StoreMissingError: Kind(500, "store_missing", is_public=False),
    errors.StoreDamagedError: Kind(500, "store_damaged", is_public=False),
    errors.RequestDamagedError: Kind(500, "request_damaged", is_public=False),
    errors.StoreTakenError: Kind(500, "store_taken", is_public=False),
    errors.TraceFailedError: Kind(422, "trace_failed"),
    errors.PlanFailedError: Kind(422, "plan_failed"),
    errors.QuoteFailedError: Kind(422, "quote_failed"),
    errors.PreviewFailedError: Kind(422, "preview_failed"),
    errors.ComparisonFailedError: Kind(422, "comparison_failed"),
    errors.InspectionFailedError: Kind(422, "inspection_failed"),
    errors.UnavailableError: Kind(503, "unavailable", retry=True),
    errors.BusyError: Kind(429, "busy", retry=True),
    errors.QueueFullError: Kind(429, "queue_full", retry=True),
    errors.WorkerLostError: Kind(503, "worker_lost", retry=True),
    PoolTimeoutError: Kind(503, "database", is_public=False, retry=True),
    DataError: Kind(422, "not_usable", is_public=False),
    DBAPIError: Kind(503, "database", is_public=False, retry=True),
}


def kind_of(error: Exception) -> Kind:
    """Look up how an exception is answered: by its class, or by the nearest class above it."""
    return next(KINDS[above] for above in type(error).__mro__ if above in KINDS)


def answer(
    status: int,
    detail: str | None = None,
    *,
    code: str | None = None,
    problems: Sequence[Problem] = (),
    more: int = 0,
    headers: dict[str, str] | None = None,
) -> Response:
    """Make the answer for an error."""
    phrase = HTTPStatus(status).phrase
    document = ProblemDocument(
        title=phrase,
        status=status,
        detail=detail,
        code=code or phrase.lower().replace(" ", "_"),
        errors=tuple(problems),
        more=more,
    )
    content = document.model_dump_json(exclude_none=True)
    return Response(content, status_code=status, media_type=MEDIA_TYPE, headers=headers)


def refusal(error: Exception, headers: dict[str, str]) -> Response:
    """Make the answer for an error that comes before any route."""
    kind = kind_of(error)
    retry = {"Retry-After": str(RETRY_AFTER_SECONDS)} if kind.retry else {}
    return answer(kind.status, _detail(kind, error), code=kind.code, headers=retry | headers)


def install(
    app: FastAPI,
    methods: Callable[[str], Sequence[str]] = lambda _: (),
    for_people: Callable[[Request], Response | None] = lambda _: None,
) -> None:
    """Register handlers for all errors of an app.

    Parameters
    ----------
    methods
        Returns the methods of a path: the framework knows those of one route only.
    for_people
        Returns what a browser shows at an unknown address, and None to programs.
    """

    def of_framework(request: Request, error: Exception) -> Response:
        assert isinstance(error, HTTPException)
        if error.status_code != HTTPStatus.METHOD_NOT_ALLOWED:
            unknown = error.detail == HTTPStatus.NOT_FOUND.phrase
            if unknown and methods(shorter := request.scope["path"].rstrip("/")):
                query = f"?{request.url.query}" if request.url.query else ""
                return RedirectResponse(quote(shorter) + query, 307)
            if unknown and (shown := for_people(request)) is not None:
                return shown
            detail = NOWHERE if unknown else error.detail
            return answer(error.status_code, detail, headers=dict(error.headers or {}))
        own = (error.headers or {}).get("Allow", "").split(", ")
        allow = ", ".join(sorted({"OPTIONS", *own, *methods(request.scope["path"])} - {""}))
        if request.method == "OPTIONS":
            return Response(status_code=HTTPStatus.NO_CONTENT, headers={"Allow": allow})
        detail = f"This address accepts {allow}."
        return answer(error.status_code, detail, headers={"Allow": allow})

    for error in KINDS:
        app.add_exception_handler(error, _known)
    app.add_exception_handler(renderer.SceneError, _of_document)
    app.add_exception_handler(RequestValidationError, _parameters)
    app.add_exception_handler(HTTPException, of_framework)
    app.add_exception_handler(Exception, _unknown)


def _known(request: Request, error: Exception) -> Response:
    error = _by_cause(error)
    kind = kind_of(error)
    headers = {"Retry-After": str(RETRY_AFTER_SECONDS)} if kind.retry else {}
    if not kind.is_public:
        # An unreachable database is no fault of the code, and each request would log it.
        trace = None if kind.retry else error
        names = {"path": request.url.path, "error": type(error).__name__, "status": kind.status}
        log.error("request failed", exc_info=trace, **names)
    if kind.status == HTTPStatus.UNAUTHORIZED:
        headers["WWW-Authenticate"] = "Bearer"
    if isinstance(error, errors.QueueFullError):
        headers |= error.headers
    if isinstance(error, errors.RangeError):
        headers["Content-Range"] = f"bytes */{error.size}"
    if isinstance(error, errors.ParametersError):
        listed, more = error.problems[:MAX_LISTED], len(error.problems[MAX_LISTED:])
        return answer(kind.status, str(error), code=kind.code, problems=listed, more=more)
    return answer(kind.status, _detail(kind, error), code=kind.code, headers=headers)


async def _of_document(request: Request, error: Exception) -> Response:
    assert isinstance(error, renderer.SceneError)
    kind, found = KINDS[renderer.SceneError], error
    if any(_lacks_line(problem) for problem in error.errors) and hasattr(request.state, "body"):
        service: Service = request.app.state.service
        client = request.client.host if request.client else ""
        problems = await service.read(client, _placed, error.errors, request.state.body)
        found = renderer.SceneError(problems, error.more)
    return answer(kind.status, str(found), code=kind.code, problems=found.errors, more=found.more)


def _lacks_line(problem: Problem) -> bool:
    # If the whole document is wrong it may not be JSON, and has no places to look up.
    return problem.line is None and problem.pointer != ""


def _placed(problems: Sequence[Problem], body: bytes) -> list[Problem]:
    """Add lines and columns to problems that are found after parsing: files, costs, limits."""
    text = body.removeprefix(codecs.BOM_UTF8).decode()
    found = iter(located(text, filter(_lacks_line, problems)))
    return [next(found) if _lacks_line(problem) else problem for problem in problems]


def _by_cause(error: Exception) -> Exception:
    """Report a full or read-only disk of SQLite like that of the pictures: it is the same one."""
    code = getattr(getattr(error, "orig", None), "sqlite_errorcode", sqlite3.SQLITE_OK)
    match code & PRIMARY_CODE:
        case sqlite3.SQLITE_FULL:
            return errors.StoreFullError(NO_ROOM)
        case sqlite3.SQLITE_READONLY:
            return errors.StoreReadOnlyError(NOT_WRITABLE)
    return error


def _detail(kind: Kind, error: Exception) -> str:
    if isinstance(error, DataError):
        return "The request has a value that the database cannot hold, such as the character U+0000."
    return str(error) if kind.is_public else "The service failed. Your request is not the cause."


def _parameters(_request: Request, error: Exception) -> Response:
    assert isinstance(error, RequestValidationError)
    problems = [_parameter(found) for found in error.errors()]
    return answer(
        422,
        problems[0].detail,
        code="parameters",
        problems=problems[:MAX_LISTED],
        more=len(problems[MAX_LISTED:]),
    )


def _parameter(found: dict[str, Any]) -> Problem:
    """Report a query, path or header parameter; its pointer is empty, because it is in no document."""
    where, *names = found["loc"]
    detail = f"The {where} parameter {'.'.join(map(str, names))!r} is not usable. {found['msg']}."
    return Problem(pointer="", detail=detail, code=found["type"])


def _unknown(request: Request, error: Exception) -> Response:
    log.error("request failed", path=request.url.path, error=type(error).__name__, status=500)
    return answer(500, "The service failed. Your request is not the cause.", code="internal")
