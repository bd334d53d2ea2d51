"""Users of a service, and what each may do."""

from __future__ import annotations

from enum import StrEnum

from pydantic import Field

from schemas.jobs import Message


class Role(StrEnum):
    """What a user may do beyond submitting jobs that nobody else sees.

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
