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
    """The answer of ``/v1/session``: whom the service takes the asker for."""

    user: str = Field(description="Name of the user; `local` where the service asks for no keys.")
    role: Role
    keys_required: bool = Field(description="Whether a request needs a key, or the cookie of a session.")


Seconds = Annotated[float, Field(ge=0, le=1e10, allow_inf_nan=False)]


class PruneRequest(Closed):
    """The body of ``POST /v1/prune``: what is not given is as the settings of the service say."""

    keep_seconds: Seconds | None = Field(
        default=None, description="How long pictures are kept after their jobs have succeeded."
    )
    max_stored_bytes: Annotated[int, Field(strict=True, ge=0, le=2**62), WHOLE] | None = Field(
        default=None, description="Bytes of all finished pictures."
    )
    keep_asset_seconds: Seconds | None = Field(
        default=None, description="How long textures and meshes are kept that no picture needs."
    )
    dry_run: bool = Field(default=True, description="Report what would be deleted, and keep it.")


class Pruned(Message):
    """The answer of ``POST /v1/prune``."""

    dry_run: bool
    expired: tuple[str, ...] = Field(description="Jobs that have lost their picture, or would.")
    forgotten: tuple[str, ...] = Field(description="Jobs that are gone, or would be.")
    pictures: int = Field(ge=0, description="Pictures that leave the disk: no other job shares them.")
    assets: tuple[str, ...] = Field(description="Textures and meshes that leave the disk, by their SHA-256.")
    bytes: int = Field(ge=0, description="How much of the disk that frees.")
    more: bool = Field(default=False, description="There is more than is listed.")
