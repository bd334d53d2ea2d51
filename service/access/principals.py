"""A user: name, role and limits."""

from __future__ import annotations

from dataclasses import dataclass
from datetime import datetime

from schemas.api.administration import Role

LOCAL_USER = "local"


@dataclass(frozen=True)
class Principal:
    """A user and the rights of their key.

    Attributes
    ----------
    max_jobs, max_cpu_seconds
        Quotas of waiting and running work; None for those of the service's settings.
    is_everyone
        Whether this stands for everyone who reaches the service.
    key, expires_at
        The id of the key that named the user, and its end; None if the user came without one.
    """

    name: str
    role: Role
    max_jobs: int | None = None
    max_cpu_seconds: float | None = None
    is_everyone: bool = False
    key: str | None = None
    expires_at: datetime | None = None

    @property
    def sees_all(self) -> bool:
        """Whether the jobs of others are shown to this user."""
        return self.role is not Role.SUBMIT

    @property
    def changes_all(self) -> bool:
        """Whether this user may stop and remove the jobs of others."""
        return self.role is Role.ADMIN


LOCAL = Principal(LOCAL_USER, Role.ADMIN, is_everyone=True)
"""Every user of a service without authentication."""
