"""Users, keys, workers and pruning of a service."""

from __future__ import annotations

from datetime import UTC, datetime
from enum import StrEnum
from typing import Annotated

from pydantic import AfterValidator, BeforeValidator, Field
from pydantic_core import PydanticCustomError

from schemas.base import Closed, Message
from schemas.quantities import WHOLE


class Role(StrEnum):
    """Permissions of a user.

    ``submit`` submits jobs and sees only these, ``staff`` sees everybody's, ``admin`` also stops and removes
    them.
    """

    SUBMIT = "submit"
    STAFF = "staff"
    ADMIN = "admin"


class WhoAmI(Message):
    """The current user, as ``/v1/session`` returns it."""

    user: str = Field(description="Name of the user; `local` without authentication.")
    role: Role = Field(description="What the user may do.")
    keys_required: bool = Field(description="Whether a request needs a key, or the cookie of a session.")


def _printable(name: str) -> str:
    if not name.isprintable():
        raise PydanticCustomError(
            "not_printable", "The name of a user may contain printable characters only."
        )
    return name


def _expiry(value: object) -> datetime:
    """Read a future date or time; one without a zone is in UTC."""
    try:
        at = datetime.fromisoformat(value)  # type: ignore[arg-type]
        at = at.astimezone(UTC) if at.tzinfo else at.replace(tzinfo=UTC)
    except (TypeError, ValueError, OverflowError):
        message = "Write a date, such as 2030-01-31 (0:00 UTC), or a time, such as 2030-01-31T18:00+01:00."
        raise PydanticCustomError("not_a_date", message) from None
    if at <= datetime.now(UTC):
        raise PydanticCustomError("out_of_range", "A key cannot expire in the past.")
    return at


UserName = Annotated[str, Field(min_length=1, max_length=64), AfterValidator(_printable)]
# The ranges of the database's column, and of the setting that a key overrides.
Jobs = Annotated[int, Field(strict=True, ge=1, le=2**31 - 1), WHOLE]
CpuSeconds = Annotated[float, Field(strict=True, ge=0.001, le=1e12, allow_inf_nan=False)]


class KeyRequest(Closed):
    """The body of ``POST /v1/keys``, and a row of a roster."""

    user: UserName = Field(description="Name of the user.")
    role: Role = Field(default=Role.SUBMIT, description="What the user may do.")
    max_jobs: Jobs | None = Field(
        default=None, description="Most queued and running jobs; by default the service's setting."
    )
    max_cpu_seconds: CpuSeconds | None = Field(
        default=None,
        description="Most predicted CPU seconds of these jobs; by default the service's setting.",
    )
    expires_at: Annotated[datetime, BeforeValidator(_expiry)] | None = Field(
        default=None, description="When the key expires, a date or a time; by default never."
    )


class KeyInfo(Message):
    """A key without its secret."""

    id: str = Field(description="Public part of the key.")
    user: str = Field(description="Name of the user.")
    role: Role = Field(description="What the user may do.")
    max_jobs: int | None = Field(
        description="Most queued and running jobs; null if the service's setting applies."
    )
    max_cpu_seconds: float | None = Field(
        description="Most predicted CPU seconds of these jobs; null if the service's setting applies."
    )
    created_at: datetime = Field(description="When the key was created.")
    expires_at: datetime | None = Field(description="When the key expires; null if never.")
    last_used_at: datetime | None = Field(description="When the key was last used, to a minute.")
    revoked_at: datetime | None = Field(description="When the key was revoked.")


class NewKey(KeyInfo):
    """A key with its secret, which is shown once."""

    key: str = Field(description="The key itself. It cannot be shown again: only its hash is stored.")


class KeyList(Message):
    """A page of keys, in the order of their users."""

    keys: tuple[KeyInfo, ...] = Field(description="The keys, revoked and expired ones included.")
    next: str | None = Field(default=None, description="`cursor` of the next page, if there is one.")


class UserUse(Message):
    """A user's share of the service."""

    user: str = Field(description="Name of the user.")
    open_jobs: int = Field(ge=0, description="Jobs that wait or run.")
    stored_bytes: int = Field(
        ge=0,
        description="Bytes of the user's pictures, textures and meshes; shared ones count for each user.",
    )
    cpu_seconds: float = Field(description="CPU seconds that were charged to the user.")
    last_used_at: datetime | None = Field(description="When a key of the user was last used.")


class UserList(Message):
    """A page of users, in the order of their names."""

    users: tuple[UserUse, ...] = Field(description="The users.")
    next: str | None = Field(default=None, description="`cursor` of the next page, if there is one.")


class WorkerInfo(Message):
    """A worker and its task."""

    name: str = Field(description="Number of its slot, or its address in a cluster.")
    pid: int | None = Field(description="Its process id; null before it starts, and in a cluster.")
    memory_bytes: int | None = Field(description="Memory of its process; null if unknown.")
    task: str | None = Field(
        description="Its task: `tile`, `sample`, `advance`, `compose`, or a call such as `trace`."
    )
    jobs: tuple[str, ...] = Field(description="The jobs of the task; none for a call.")
    users: tuple[str, ...] = Field(description="The users of these jobs, or of the call.")
    seconds: float = Field(ge=0, description="How long the task has run.")


class WorkerList(Message):
    """The workers of one server."""

    server: str = Field(description="Host and process of the server that answers; others have their own.")
    workers: tuple[WorkerInfo, ...] = Field(description="Its workers.")


Seconds = Annotated[float, Field(ge=0, le=1e10, allow_inf_nan=False)]


class PruneRequest(Closed):
    """The body of ``POST /v1/prune``; missing rules come from the settings of the service."""

    keep_seconds: Seconds | None = Field(
        default=None, description="Delete pictures of jobs that succeeded more than so many seconds ago."
    )
    max_stored_bytes: Annotated[int, Field(strict=True, ge=0, le=2**62), WHOLE] | None = Field(
        default=None, description="Delete the oldest pictures until all take at most so many bytes."
    )
    keep_asset_seconds: Seconds | None = Field(
        default=None,
        description="Delete unused assets that were last uploaded or checked more than so many seconds ago.",
    )
    dry_run: bool = Field(default=True, description="Only report what would be deleted.")


class Pruned(Message):
    """Jobs that were deleted, or would be, as ``POST /v1/prune`` returns them."""

    dry_run: bool = Field(description="Whether nothing was deleted.")
    expired: tuple[str, ...] = Field(description="Jobs whose picture is deleted, or would be.")
    forgotten: tuple[str, ...] = Field(description="Jobs that are deleted, or would be.")
    pictures: int = Field(ge=0, description="Pictures deleted from the disk: no other job shares them.")
    assets: tuple[str, ...] = Field(description="Assets deleted from the disk, by their SHA-256.")
    bytes: int = Field(ge=0, description="Bytes that this frees.")
    more: bool = Field(default=False, description="Whether the lists are incomplete.")
