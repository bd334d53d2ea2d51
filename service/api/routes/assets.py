"""Textures and meshes by the SHA-256 of their bytes."""

from __future__ import annotations

from datetime import UTC, datetime
from typing import Annotated, Any

from fastapi import APIRouter, Path, Request
from fastapi.concurrency import run_in_threadpool
from fastapi.responses import Response
from sqlalchemy.exc import IntegrityError

from schemas.api.jobs import Asset
from service.access.principals import Principal
from service.api.authentication import CurrentUser
from service.api.bodies import chunks
from service.api.request_headers import check_preconditions
from service.api.routes.parameters import BINARY, CHANGED, problem
from service.api.routes.stored import stored_response
from service.errors import BodyTooLargeError, UnknownAssetError, UploadQuotaError
from service.jobs import uploads
from service.jobs.context import Here, Service
from service.storage.assets import PREFIX
from service.storage.database.models import AssetRow

router = APIRouter(prefix="/v1/assets", tags=["assets"])

Sha256 = Annotated[str, Path(pattern="^[0-9a-f]{64}$", description="64 lower-case hexadecimal digits.")]
UNKNOWN: dict[int | str, dict[str, Any]] = problem(
    404, "You have not uploaded such an asset.", "unknown_asset"
)
STORED: dict[int | str, dict[str, Any]] = {
    200: {"description": "The file.", "content": {"application/octet-stream": BINARY}},
    206: {
        "description": "The bytes that `Range` asked for.",
        "content": {"application/octet-stream": BINARY},
    },
    304: {"description": "You have it already, by `If-None-Match` or `If-Modified-Since`."},
}
UPLOAD = {"requestBody": {"required": True, "content": {"application/octet-stream": BINARY}}}


@router.put(
    "/{sha256}",
    responses=problem(408, "The body arrived too slowly.", "body_slow")
    | problem(
        413, "The file is too large, or there is no room in your quota.", "body_too_large", "upload_quota"
    )
    | problem(415, "The body is compressed.", "media_type")
    | problem(
        422,
        "The bytes have a different hash, or are not a usable picture or mesh.",
        "upload_mismatch",
        "upload_unusable",
    )
    | problem(507, "The disk is full.", "store_full")
    | CHANGED,
    openapi_extra=UPLOAD,
    summary="Upload a texture or a mesh",
    response_description="The asset. `name` is how a scene names it.",
)
async def put_asset(here: Here, request: Request, sha256: Sha256, user: CurrentUser) -> Asset:
    """Upload a texture or a mesh by the SHA-256 of its bytes. Sending it again changes nothing.

    Only users who have sent a file may use it: knowing its hash is not enough.
    """
    check_preconditions(request, await run_in_threadpool(_version, here, user, sha256))
    most, room = here.settings.max_asset_bytes, await run_in_threadpool(_room, here, user, sha256)
    content = chunks(request, min(most, room), here.settings.client_timeout_seconds)
    try:
        size, header = await here.assets.receive(sha256, content)
    except BodyTooLargeError:
        if room >= most:
            raise
        raise UploadQuotaError(here.settings.max_user_asset_bytes, room) from None
    row = AssetRow(
        sha256=sha256,
        bytes=size,
        media_type=header.media_type,
        width=header.width,
        height=header.height,
        created_at=(now := datetime.now(UTC)),
        used_at=now,
    )
    try:
        return await run_in_threadpool(_keep, here, row, user)
    except IntegrityError:  # another request has entered it meanwhile
        return await run_in_threadpool(_keep, here, row, user)


def _version(service: Service, principal: Principal, sha256: str) -> dict[str, str]:
    """Tag what the user has uploaded before; nothing where that is nothing."""
    with service.database.reading() as session:
        return {"ETag": f'"{sha256}"'} if uploads.find_upload(session, sha256, principal) else {}


def _room(service: Service, principal: Principal, sha256: str) -> int:
    """How many bytes a user may send; without authentication there is no limit."""
    if principal.is_everyone:
        return service.settings.max_asset_bytes
    with service.database.reading() as session:
        taken = uploads.bytes_of(session, principal.name, apart_from=sha256)
    return max(0, service.settings.max_user_asset_bytes - taken)


def _keep(service: Service, row: AssetRow, principal: Principal) -> Asset:
    with service.database.writing() as session:
        return _describe(uploads.enter_upload(session, row, principal.name))


def _describe(row: AssetRow) -> Asset:
    return Asset(
        name=PREFIX + row.sha256,
        bytes=row.bytes,
        media_type=row.media_type,
        width=row.width,
        height=row.height,
    )


@router.head(
    "/{sha256}",
    response_class=Response,
    responses=UNKNOWN,
    operation_id="head_asset",
    summary="Check for an asset",
    description="Ask whether you have uploaded a file. If so, it is kept as if uploaded just now.",
    response_description="You have uploaded it.",
)
@router.get(
    "/{sha256}",
    response_class=Response,
    responses=STORED | UNKNOWN | CHANGED | problem(416, "The range is outside the file.", "range"),
    operation_id="get_asset",
    summary="Get an asset",
)
def get_asset(here: Here, request: Request, sha256: Sha256, user: CurrentUser) -> Response:
    """Get a texture or a mesh exactly as it was uploaded. Files of other users are answered 404."""
    with here.database.reading() as session:
        row = uploads.find_upload(session, sha256, user)
    if row is None:
        raise UnknownAssetError
    if request.method == "HEAD" and uploads.is_due(row):
        # A client that finds it here does not send it again, and relies on it.
        with here.database.writing() as session:
            uploads.note(session, sha256)
    etag = f'"{sha256}"'
    headers = {"ETag": etag, "Content-Disposition": "attachment", "X-Content-Type-Options": "nosniff"}
    stored = here.assets.find(sha256, row.bytes)
    if stored is None:
        raise UnknownAssetError
    try:
        return stored_response(request, stored, row.media_type, headers)
    except FileNotFoundError:
        raise UnknownAssetError from None
