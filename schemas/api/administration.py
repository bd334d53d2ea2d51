"""Users of a service and what each may do, and what it deletes on request."""

from __future__ import annotations

from enum import StrEnum
from typing import Annotated

from pydantic import Field

from schemas.base import Closed, Message
from schemas.quantities import WHOLE


class Role(StrEnum):
    """What a user may do beyond submitting jobs that no one else sees.

    ``staff`` sees the jobs of all, ``admin`` also stops and removes them.
    """

    SUBMIT = "submit"
    STAFF = "staff"
    ADMIN = "admin"


class WhoAmI(Message):
    """The current user, as ``/v1/session`` returns it."""

    user: str = Field(description="Name of the user; `local` without authentication.")
    role: Role = Field(description="What the user may do.")
    keys_required: bool = Field(description="Whether a request needs a key, or the cookie of a session.")


Seconds = Annotated[float, Field(ge=0, le=1e10, allow_inf_nan=False)]


class PruneRequest(Closed):
    """The body of ``POST /v1/prune``. Rules that are not given come from the settings of the service."""

    keep_seconds: Seconds | None = Field(
        default=None, description="Delete pictures of jobs that succeeded longer ago than this."
    )
    max_stored_bytes: Annotated[int, Field(strict=True, ge=0, le=2**62), WHOLE] | None = Field(
        default=None, description="Delete the oldest pictures beyond this size of all."
    )
    keep_asset_seconds: Seconds | None = Field(
        default=None,
        description="Delete assets that no picture needs, last uploaded or checked longer ago than this.",
    )
    dry_run: bool = Field(default=True, description="Only report what would be deleted.")


class Pruned(Message):
    """What was deleted, or would be, as ``POST /v1/prune`` returns it."""

    dry_run: bool = Field(description="Whether it was only listed.")
    expired: tuple[str, ...] = Field(description="Jobs whose picture is deleted, or would be.")
    forgotten: tuple[str, ...] = Field(description="Jobs that are deleted, or would be.")
    pictures: int = Field(ge=0, description="Pictures deleted from the disk: no other job shares them.")
    assets: tuple[str, ...] = Field(description="Assets deleted from the disk, by their SHA-256.")
    bytes: int = Field(ge=0, description="Bytes that this frees.")
    more: bool = Field(default=False, description="Whether there is more than is listed.")
