"""Databases by their URLs: SQLite, or PostgreSQL by psycopg."""

from __future__ import annotations

from typing import Any

from pydantic_core import from_json
from sqlalchemy import URL, Engine, create_engine
from sqlalchemy.engine import make_url
from sqlalchemy.exc import ArgumentError

from service.errors import DatabaseUrlError

# SQLite has no limit to its connections, a PostgreSQL server has one for all who use it: 100 by default.
_SQLITE = {"pool_size": 16, "max_overflow": 48}
_POSTGRESQL = {
    "pool_size": 8,
    "max_overflow": 8,
    "pool_timeout": 10,
    # An idle connection may have ended with the server that it led to.
    "pool_pre_ping": True,
}
# A network that drops everything is noticed after seconds; by default it would take minutes.
_LIFE = {
    "connect_timeout": "3",
    "keepalives_idle": "5",
    "keepalives_interval": "2",
    "keepalives_count": "3",
    "tcp_user_timeout": "10000",
}
ANSWER_SECONDS = 15.0
"""An answer of PostgreSQL that takes longer never comes: no statement waits as long for other writers."""
POSTGRESQL = {"postgresql", "postgres", "postgresql+psycopg"}
"""Schemes of one database: the two that PostgreSQL's own tools accept, of which the documentation recommends
the first, and the one with the driver's name."""


def engine_of(url: str) -> Engine:
    """Make the engine for a URL; nothing is connected yet.

    Raises
    ------
    DatabaseUrlError
        If it is not a URL, of another kind of database, or its driver is not installed.
    """
    parsed = parse(url)
    if parsed.get_backend_name() == "sqlite":
        return create_engine(parsed, json_deserializer=from_json, **_SQLITE)
    try:
        from service.storage.database import answers  # noqa: PLC0415 - the driver is in an extra
    except ImportError:
        raise DatabaseUrlError(
            "PostgreSQL needs the package psycopg. Install it with: pip install 'penumbra-render[postgres]'"
        ) from None
    engine = create_engine(parsed, json_deserializer=from_json, **_POSTGRESQL)
    answers.limit(engine)
    return engine


def is_shared(url: str) -> bool:
    """Whether several servers may use a database at the same time.

    Raises
    ------
    DatabaseUrlError
        If the URL cannot be used.
    """
    return parse(url).get_backend_name() == "postgresql"


def parse(url: str) -> URL:
    """Read a URL; of PostgreSQL it names the driver afterwards, and how long to wait for a dead network.

    Raises
    ------
    DatabaseUrlError
        If it is not a URL, or of another kind of database.
    """
    try:
        parsed = make_url(url)
    except (ArgumentError, ValueError):
        raise DatabaseUrlError("The address of the database is not a URL like sqlite:///file.") from None
    if parsed.drivername in POSTGRESQL:
        wanted: dict[str, Any] = _LIFE | dict(parsed.query)
        return parsed.set(drivername="postgresql+psycopg", query=wanted)
    if parsed.drivername in {"sqlite", "sqlite+pysqlite"}:
        return parsed
    raise DatabaseUrlError(
        f"Jobs cannot be stored in {parsed.drivername!r}. "
        "Write sqlite:///file, or postgresql://user@host/name."
    )
