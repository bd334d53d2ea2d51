"""Those who ask, as the service knows them."""

from __future__ import annotations

from dataclasses import dataclass

from schemas.access import Role

LOCAL_USER = "local"


@dataclass(frozen=True)
class Asker:
    """A user, with what his key says of him.

    Attributes
    ----------
    max_jobs, max_cpu_seconds
        How much of him may wait or run at once; by default what the settings of the service say.
    """

    name: str
    role: Role
    max_jobs: int | None = None
    max_cpu_seconds: float | None = None

    @property
    def sees_all(self) -> bool:
        """Whether the jobs of others are shown to him."""
        return self.role is not Role.SUBMIT

    @property
    def changes_all(self) -> bool:
        """Whether he may stop and remove the jobs of others."""
        return self.role is Role.ADMIN


LOCAL = Asker(LOCAL_USER, Role.ADMIN)
"""Whoever reaches a service that asks for no keys."""
