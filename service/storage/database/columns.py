"""Kinds of columns that SQLite and PostgreSQL do not have in common."""

from __future__ import annotations

from datetime import UTC, datetime

from sqlalchemy import BigInteger, DateTime, Dialect, Integer
from sqlalchemy.types import TypeDecorator

COUNT = BigInteger().with_variant(Integer, "sqlite")
"""64 bits: what an integer of SQLite has by any name, and the samples of a large picture need."""


class UtcDateTime(TypeDecorator[datetime]):
    """A time in UTC. SQLite stores no zone and PostgreSQL does; reading adds it."""

    impl = DateTime(timezone=True)
    cache_ok = True

    def process_result_value(self, value: datetime | None, dialect: Dialect) -> datetime | None:  # noqa: ARG002  (an SQLAlchemy interface)
        """Put the zone back where the database has none."""
        return value if value is None else value.replace(tzinfo=value.tzinfo or UTC)
