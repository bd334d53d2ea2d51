"""Textures and meshes by the SHA-256 of their bytes."""

from __future__ import annotations

from datetime import UTC, datetime
from typing import Annotated, Any

from fastapi import APIRouter, Path, Request
from fastapi.concurrency import run_in_threadpool
from fastapi.responses import FileResponse, Response
from sqlalchemy.orm import Session

from schemas.jobs import Asset
from service.bodies import chunks
from service.context import Here, Service
from service.database.models import AssetRow
from service.errors import UnknownAssetError
from service.routes.parameters import not_modified, problem
from service.store.assets import PREFIX

router = APIRouter(prefix="/v1/assets", tags=["assets"])

Sha256 = Annotated[str, Path(pattern="^[0-9a-f]{64}$", description="64 lower-case hexadecimal digits.")]
UNKNOWN = problem(404, "No such asset was uploaded.")
FILE: dict[str, Any] = {"schema": {"type": "string", "format": "binary"}}
UPLOAD = {"requestBody": {"required": True, "content": {"application/octet-stream": FILE}}}


@router.put(
    "/{sha256}",
    responses=problem(413, "The file is too large.")
    | problem(422, "The bytes have another hash, or are neither a picture nor a mesh that can be used.")
    | problem(507, "The disk is full."),
    openapi_extra=UPLOAD,
)
async def put_asset(here: Here, request: Request, sha256: Sha256) -> Asset:
    """Upload a texture or a mesh. Sending it again changes nothing."""
    size, header = await here.assets.receive(sha256, chunks(request, here.settings.max_asset_bytes))
    row = AssetRow(
        sha256=sha256,
        bytes=size,
        media_type=header.media_type,
        width=header.width,
        height=header.height,
        created_at=datetime.now(UTC),
    )
    return await run_in_threadpool(_keep, here, row)


def _keep(service: Service, row: AssetRow) -> Asset:
    with service.database.writing() as session:
        return _describe(session.get(AssetRow, row.sha256) or _added(session, row))


def _added(session: Session, row: AssetRow) -> AssetRow:
    session.add(row)
    return row


def _describe(row: AssetRow) -> Asset:
    return Asset(
        name=PREFIX + row.sha256,
        bytes=row.bytes,
        media_type=row.media_type,
        width=row.width,
        height=row.height,
    )


@router.head("/{sha256}", response_class=Response, responses=UNKNOWN, operation_id="head_asset")
@router.get("/{sha256}", response_class=Response, responses=UNKNOWN, operation_id="get_asset")
def get_asset(here: Here, request: Request, sha256: Sha256) -> Response:
    """Get a texture or a mesh back, byte by byte as it was sent."""
    with here.database.reading() as session:
        row = session.get(AssetRow, sha256)
    if row is None:
        raise UnknownAssetError
    etag = f'"{sha256}"'
    headers = {"ETag": etag, "Content-Disposition": "attachment", "X-Content-Type-Options": "nosniff"}
    return not_modified(request, etag) or FileResponse(
        here.assets.path(sha256), media_type=row.media_type, headers=headers
    )
