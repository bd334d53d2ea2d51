"""Textures and meshes by the SHA-256 of their bytes."""

from __future__ import annotations

import math
from collections.abc import AsyncIterator, Callable
from datetime import UTC, datetime
from typing import Annotated, Any

from fastapi import APIRouter, Path, Request
from fastapi.concurrency import run_in_threadpool
from fastapi.responses import Response
from sqlalchemy.exc import IntegrityError
from sqlalchemy.orm import Session

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
    with here.uploads.counting(user) as count:
        size, header = await here.assets.receive(sha256, _content(here, request, sha256, user, count))
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
            return await here.write(_keep, here, row, user)
        except IntegrityError:  # another request has entered it meanwhile
            return await here.write(_keep, here, row, user)


async def _content(
    here: Service, request: Request, sha256: str, user: Principal, count: Callable[[int], None]
) -> AsyncIterator[bytes]:
    """Iterate over a body as it arrives, within the quota of its user, in which other uploads count too.

    Raises
    ------
    UploadQuotaError
        As soon as it is known that there is no room for it.
    """
    most, quota = here.settings.max_asset_bytes, here.settings.max_user_asset_bytes
    room = await run_in_threadpool(_room, here, user, sha256)
    try:
        async for chunk in chunks(request, int(min(most, room)), here.settings.client_timeout_seconds):
            if here.uploads.bytes_of(user) + len(chunk) > room:
                raise UploadQuotaError(quota, 0)
            count(len(chunk))
            yield chunk
    except BodyTooLargeError:
        if room >= most:
            raise
        raise UploadQuotaError(quota, int(room)) from None
    # Other uploads count as uploads under way, or in the database, which is read afterwards.
    arrived = here.uploads.bytes_of(user)
    if arrived > await run_in_threadpool(_room, here, user, sha256):
        raise UploadQuotaError(quota, 0)


def _version(service: Service, principal: Principal, sha256: str) -> dict[str, str]:
    """Return the tag of an asset that the user has uploaded, or no headers."""
    with service.database.reading() as session:
        return {"ETag": f'"{sha256}"'} if uploads.find_upload(session, sha256, principal) else {}


def _room(service: Service, principal: Principal, sha256: str) -> float:
    """Asset quota of a user, bytes; no limit without authentication."""
    with service.database.reading() as session:
        return _room_in(session, service, principal, sha256)


def _room_in(session: Session, service: Service, principal: Principal, sha256: str) -> float:
    if principal.is_everyone:
        return math.inf
    taken = uploads.bytes_of(session, principal.name, apart_from=sha256)
    return max(0, service.settings.max_user_asset_bytes - taken)


def _keep(service: Service, row: AssetRow, principal: Principal) -> Asset:
    """Enter an asset. Another server may have received others meanwhile; the file stays until it is swept."""
    with service.database.writing() as session:
        room = _room_in(session, service, principal, row.sha256)
        if row.bytes > room:
            raise UploadQuotaError(service.settings.max_user_asset_bytes, int(room))
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
async def get_asset(here: Here, request: Request, sha256: Sha256, user: CurrentUser) -> Response:
    """Get a texture or a mesh exactly as it was uploaded. Files of other users are answered 404."""
    row = await run_in_threadpool(_find, here, sha256, user)
    if request.method == "HEAD" and uploads.is_due(row):
        # A client that finds it here relies on it, and does not send it again.
        await here.write(_note, here, sha256)
    return await run_in_threadpool(_stored, here, request, row)


def _find(service: Service, sha256: str, principal: Principal) -> AssetRow:
    with service.database.reading() as session:
        row = uploads.find_upload(session, sha256, principal)
    if row is None:
        raise UnknownAssetError
    return row


def _note(service: Service, sha256: str) -> None:
    with service.database.writing() as session:
        uploads.note(session, sha256)


def _stored(here: Service, request: Request, row: AssetRow) -> Response:
    sha256 = row.sha256
    etag = f'"{sha256}"'
    headers = {"ETag": etag, "Content-Disposition": "attachment", "X-Content-Type-Options": "nosniff"}
    stored = here.assets.find(sha256, row.bytes)
    if stored is None:
        raise UnknownAssetError
    try:
        return stored_response(request, stored, row.media_type, headers)
    except FileNotFoundError:
        raise UnknownAssetError from None
