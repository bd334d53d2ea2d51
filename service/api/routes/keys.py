"""Keys over HTTP: list, create and revoke them, one by one or from a roster. For admins."""

from __future__ import annotations

from typing import Annotated, Any

from fastapi import APIRouter, Depends, Path, Query, Request, Response

from schemas.api.administration import KeyInfo, KeyList, KeyRequest, NewKey
from schemas.reading import read_document
from service.access import keys, roster
from service.access.principals import Principal
from service.api.authentication import Admin
from service.api.bodies import JsonBody, chunks
from service.api.routes.jobs import BODY
from service.api.routes.parameters import json_request, problem
from service.errors import ForbiddenError, UnknownKeyError
from service.jobs.context import Here, Service
from service.storage.database.models import KeyRow

router = APIRouter(prefix="/v1", tags=["access"])

NOT_ADMIN = problem(403, "Only an admin may do this, with a key.", "forbidden")
UNUSABLE = problem(422, "The request cannot be used; `errors` lists every reason.", "scene_not_usable")
CSV: dict[str, Any] = {"text/csv": {"schema": {"type": "string"}}}
EXAMPLE = {"user": "ada", "role": "submit", "max_jobs": 100, "expires_at": "2099-01-31"}


async def _admin_with_key(user: Admin) -> Principal:
    # The first key of a service locks everybody else out, so only those who can read its data may create it.
    if user.key is None:
        raise ForbiddenError(
            "Keys are created and revoked with the key of an admin. The service's operator makes the first "
            "one with 'penumbra keys add NAME --role admin'."
        )
    return user


KEY_ADMIN = [Depends(_admin_with_key)]


@router.get(
    "/keys",
    responses=problem(403, "Only admins may do this.", "forbidden"),
    summary="List keys",
    response_description="One page of keys, in the order of their users.",
)
def list_keys(
    here: Here,
    user: Admin,  # noqa: ARG001  (checked)
    limit: Annotated[int, Query(ge=1, le=1000, description="Keys on a page.")] = 100,
    cursor: Annotated[str | None, Query(max_length=12, description="`next` of the previous page.")] = None,
) -> KeyList:
    """List all keys, without their secrets, which are not stored."""
    with here.database.reading() as session:
        rows = keys.page(session, limit + 1, cursor)
        found = tuple(KeyInfo.model_validate(row, from_attributes=True) for row in rows[:limit])
    return KeyList(keys=found, next=found[-1].id if len(rows) > limit else None)


@router.post(
    "/keys",
    status_code=201,
    dependencies=KEY_ADMIN,
    responses=BODY | NOT_ADMIN | UNUSABLE,
    openapi_extra=json_request(KeyRequest, EXAMPLE),
    summary="Create a key",
    response_description="The key, which is shown this once.",
)
async def create_key(here: Here, body: JsonBody) -> NewKey:
    """Create a key for a user, who may have several."""
    asked, _ = read_document(body, KeyRequest)
    return await here.write(_create, here, asked)


def _create(service: Service, asked: KeyRequest) -> NewKey:
    with service.database.writing() as session:
        key = keys.add(session, **dict(asked))
        info = KeyInfo.model_validate(session.get_one(KeyRow, key.id), from_attributes=True)
    return NewKey(**dict(info), key=str(key))


@router.delete(
    "/keys/{key_id}",
    status_code=204,
    response_class=Response,
    dependencies=KEY_ADMIN,
    responses=NOT_ADMIN | problem(404, "There is no such key.", "unknown_key"),
    summary="Revoke a key",
    response_description="The key and its sessions are no longer valid.",
)
async def revoke_key(
    here: Here, key_id: Annotated[str, Path(max_length=12, description="The key's id.")]
) -> None:
    """Revoke a key and its sessions within a second. The user's jobs stay."""
    await here.write(_revoke, here, key_id)
    here.credentials.clear()


def _revoke(service: Service, key_id: str) -> None:
    with service.database.writing() as session:
        if not keys.revoke(session, key_id):
            raise UnknownKeyError


@router.post(
    "/rosters",
    response_class=Response,
    dependencies=KEY_ADMIN,
    responses=BODY | NOT_ADMIN | UNUSABLE | {200: {"content": CSV}},
    openapi_extra={
        "requestBody": {"required": True, "content": {"text/csv": {"schema": {"type": "string"}}}}
    },
    summary="Create the keys of a class",
    response_description="The keys as CSV: `user,role,id,expires_at,key`.",
)
async def enrol(here: Here, request: Request) -> Response:
    """Create a key for each user of a roster who has no valid one; the same roster creates none twice.

    The roster is CSV in UTF-8. Its first line names the columns, which are the fields of `POST /v1/keys`;
    `user` is required. In the response, `key` is empty for users who had a key already.
    """
    content = chunks(request, roster.MAX_BYTES, here.settings.client_timeout_seconds)
    body = b"".join([part async for part in content])
    return await here.write(_enrol, here, body)


def _enrol(service: Service, body: bytes) -> Response:
    asked = roster.read(body)
    with service.database.writing() as session:
        made = roster.enrol(session, asked)
    return Response(roster.write(made), media_type="text/csv")
