"""Transactions on the database named by an SQLAlchemy URL."""

from __future__ import annotations

import json
import math
import secrets
import sqlite3
import threading
import time
from collections.abc import Iterable, Iterator, Mapping
from contextlib import contextmanager, nullcontext
from contextvars import ContextVar
from typing import Any

from sqlalchemy import Connection, Engine, event, text
from sqlalchemy.engine.interfaces import DBAPIConnection, ExceptionContext
from sqlalchemy.exc import DBAPIError, SQLAlchemyError
from sqlalchemy.exc import TimeoutError as PoolTimeoutError
from sqlalchemy.orm import Session
from sqlalchemy.pool import ConnectionPoolEntry

from service.storage.database.urls import ANSWER_SECONDS, engine_of

BUSY_SECONDS = 10.0
"""Seconds that a transaction waits for its turn to write."""
LOG_BYTES = 4 << 20
"""Size of SQLite's log after a checkpoint, bytes: about the size that it has without long readers."""
# A server that was stopped in the middle of a transaction, or cut off, delays others at most this long.
SILENCE_TIMEOUT_MS = 3_000
# Any numbers that other programs on the same database do not use.
WRITER_LOCK = 0x50454E554D425241
STARTER_LOCK = WRITER_LOCK + 1
# Seconds for the checks of a starting server outside of the database, such as that of a bucket.
START_TIMEOUT_MS = 60_000
CHANNEL = "penumbra"
# A notice has room for 8,000 bytes.
MOST_NOTIFIED = 200
# Seconds until a stopping service ends listening.
LISTEN_SECONDS = 0.5
# How often a service notifies itself, and how long the answer may take, seconds. A connection that is lost in
# silence is one of which nothing else tells: who waits for a job waits for the sum of both.
HEARTBEAT_SECONDS, HEARD_SECONDS = 2.0, 3.0
PRIMARY_CODE = 0xFF
"""The bits of an error code of SQLite that say its kind."""

_UNTIL: ContextVar[float] = ContextVar("until", default=math.inf)

_NOTIFY = text("SELECT pg_notify(:channel, :document)")


@contextmanager
def patience(seconds: float) -> Iterator[None]:
    """Let transactions that begin in the block wait for their turn no longer than until this time is over."""
    token = _UNTIL.set(time.monotonic() + seconds)
    try:
        yield
    finally:
        _UNTIL.reset(token)


def _left(until: float) -> float:
    return max(0.0, until - time.monotonic())


class Database:
    """Opens read and write transactions, of which one writes at a time.

    A transaction that reads first and writes later could otherwise fail in the middle, or count wrongly,
    because another one wrote in between. On SQLite it takes the write lock when it begins, on PostgreSQL a
    lock that the servers of a database share. The threads of this process take turns before they ask for it:
    SQLite has those who wait try again and again, and some of many would wait until they give up; on
    PostgreSQL they would leave no connections to those who read.

    Parameters
    ----------
    url : str
        SQLAlchemy URL of SQLite or PostgreSQL.

    Attributes
    ----------
    shared : bool
        Whether other servers may use it at the same time.

    Raises
    ------
    DatabaseUrlError
        If the URL cannot be used.
    """

    def __init__(self, url: str) -> None:
        self.engine = engine_of(url)
        self.shared = self.engine.dialect.name == "postgresql"
        if self.shared:
            event.listen(self.engine, "begin", _begin_postgresql)
            self._reader: Engine = self.engine.execution_options(
                isolation_level="REPEATABLE READ", postgresql_readonly=True
            )
        else:
            event.listen(self.engine, "connect", _prepare_sqlite)
            event.listen(self.engine, "begin", _begin_sqlite)
            event.listen(self.engine, "handle_error", _give_up_sqlite)
            self._reader = self.engine
        self._name = secrets.token_hex(8)
        self._heartbeat = f"{CHANNEL}_{self._name}"
        self._lock = threading.Lock()
        self._writer = self.engine.execution_options(writes=True)

    @contextmanager
    def reading(self) -> Iterator[Session]:
        """One consistent view of the database; nothing is kept."""
        with Session(self._reader) as session:
            yield session

    @contextmanager
    def writing(self) -> Iterator[Session]:
        """A transaction that is committed at the end, or undone when an exception leaves it."""
        until = min(_UNTIL.get(), time.monotonic() + BUSY_SECONDS)
        with self._in_turn(until):
            engine = self._writer.execution_options(until=until)
            with Session(engine, expire_on_commit=False) as session, session.begin():
                yield session

    @contextmanager
    def starting(self) -> Iterator[None]:
        """Keep other servers that start waiting until the block ends; those that run read and write.

        On SQLite there is one server.
        """
        if not self.shared:
            yield
            return
        with self.engine.execution_options(lock=STARTER_LOCK, silence_ms=START_TIMEOUT_MS).begin():
            yield

    @contextmanager
    def _in_turn(self, until: float) -> Iterator[None]:
        if not self._lock.acquire(timeout=_left(until)):
            raise PoolTimeoutError("Other threads were writing all the time.")
        try:
            yield
        finally:
            self._lock.release()

    @contextmanager
    def pipelined(self, session: Session) -> Iterator[None]:
        """Send the statements of the block without waiting for an answer after each; none may return rows.

        Raises
        ------
        sqlalchemy.exc.DBAPIError
            What the first one of them has raised that failed.
        """
        with _pipeline(session.connection()) if self.shared else nullcontext():
            yield

    def notify(self, session: Session, **notice: Any) -> None:
        """Notify the other servers on this database, if there may be some, once it is committed."""
        if self.shared:
            document = json.dumps(notice | {"from": self._name})
            session.execute(_NOTIFY, {"channel": CHANNEL, "document": document})

    def notify_jobs(self, session: Session, jobs: Iterable[str]) -> None:
        """Notify the other servers that jobs have changed."""
        ids = sorted(jobs) if self.shared else []
        for start in range(0, len(ids), MOST_NOTIFIED):
            self.notify(session, jobs=ids[start : start + MOST_NOTIFIED])

    def notices(self, stopping: threading.Event) -> Iterator[dict[str, Any]]:
        """Wait for notices of other servers. An empty one comes first: something may have been missed.

        Raises
        ------
        Exception
            One of ``errors``, when the connection is lost.
        """
        with self.engine.connect().execution_options(
            isolation_level="AUTOCOMMIT", answer_seconds=HEARD_SECONDS
        ) as connection:
            # A connection that has listened must not return to the pool.
            connection.detach()
            for channel in (CHANNEL, self._heartbeat):
                connection.exec_driver_sql(f"LISTEN {channel}")
            yield {}
            while not stopping.is_set():
                connection.exec_driver_sql(f"NOTIFY {self._heartbeat}")
                yield from self._heard(connection, stopping)

    def _heard(self, connection: Connection, stopping: threading.Event) -> Iterator[dict[str, Any]]:
        """Listen until the next heartbeat is due; raise an error if this one is not heard."""
        driver: Any = connection.connection.dbapi_connection
        alive, until = False, time.monotonic() + HEARTBEAT_SECONDS
        while not stopping.is_set():
            for notice in driver.notifies(timeout=LISTEN_SECONDS):
                if notice.channel == self._heartbeat:
                    alive = True
                elif (document := json.loads(notice.payload)).pop("from") != self._name:
                    yield document
            if time.monotonic() > until:
                break
        if not alive and not stopping.is_set():
            raise self.engine.dialect.loaded_dbapi.OperationalError("No notification arrives.")

    @property
    def errors(self) -> tuple[type[Exception], ...]:
        """Exceptions of ``notices``."""
        return SQLAlchemyError, self.engine.dialect.loaded_dbapi.Error

    def check(self) -> None:
        """Raise what the database raises when it cannot be written now."""
        with self.writing() as session:
            session.execute(text("SELECT 1"))

    def close(self) -> None:
        """Close all connections."""
        self.engine.dispose()


def _prepare_sqlite(connection: DBAPIConnection, _entry: ConnectionPoolEntry) -> None:
    assert isinstance(connection, sqlite3.Connection)
    # The driver would begin transactions by its own rules; _begin_sqlite does so by ours.
    connection.isolation_level = None
    cursor = connection.cursor()
    cursor.execute("PRAGMA journal_mode = WAL")
    # In WAL mode NORMAL loses nothing when the process dies; a power cut may lose the last transactions.
    cursor.execute("PRAGMA synchronous = NORMAL")
    cursor.execute("PRAGMA foreign_keys = ON")
    # Where readers have kept it from beginning its log anew, that gives the disk back once they have ended.
    cursor.execute(f"PRAGMA journal_size_limit = {LOG_BYTES}")
    cursor.close()


def _begin_sqlite(connection: Connection) -> None:
    options = connection.get_execution_options()
    connection.exec_driver_sql(f"PRAGMA busy_timeout = {_patience_ms(options)}")
    connection.exec_driver_sql("BEGIN IMMEDIATE" if options.get("writes", False) else "BEGIN")


def _patience_ms(options: Mapping[str, Any]) -> int:
    until = options.get("until")
    return int(1000 * (BUSY_SECONDS if until is None else _left(until)))


def _give_up_sqlite(failure: ExceptionContext) -> None:
    """Close a connection that may only read: one made while the disk was read-only stays so for ever."""
    code = getattr(failure.original_exception, "sqlite_errorcode", sqlite3.SQLITE_OK)
    if code & PRIMARY_CODE == sqlite3.SQLITE_READONLY:
        failure.is_disconnect = True


def _begin_postgresql(connection: Connection) -> None:
    options = connection.get_execution_options()
    driver: Any = connection.connection.dbapi_connection
    driver.answer_seconds = options.get("answer_seconds", ANSWER_SECONDS)
    lock = options.get("lock", WRITER_LOCK if options.get("writes", False) else None)
    if lock is None:
        return
    silence_ms = options.get("silence_ms", SILENCE_TIMEOUT_MS)
    # Set only for this transaction, since connections may come from a shared pool.
    set_and_lock = (
        # Zero would be no limit.
        f"SELECT set_config('lock_timeout', '{_patience_ms(options) + 1}', true),"
        f" set_config('idle_in_transaction_session_timeout', '{silence_ms}', true),"
        f" pg_advisory_xact_lock({lock})"
    )
    # Together with the beginning of the transaction, which the driver would send and wait for first.
    with _pipeline(connection):
        driver.execute(set_and_lock)


@contextmanager
def _pipeline(connection: Connection) -> Iterator[None]:
    driver: Any = connection.connection.dbapi_connection
    raised = connection.dialect.loaded_dbapi.Error
    try:
        with driver.pipeline():
            yield
    except raised as error:
        about = {"connection_invalidated": driver.closed, "dialect": connection.dialect}
        raise DBAPIError.instance(None, None, error, raised, **about) from error
