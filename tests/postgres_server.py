"""A PostgreSQL server of the tests' own: started from this machine's programs, in a folder of its own."""

from __future__ import annotations

import itertools
import os
import pwd
import shutil
import subprocess
import tempfile
from pathlib import Path
from typing import Any

from sqlalchemy import create_engine, text

from service.database.connection import Database
from service.database.migrations import upgrade
from service.database.models import Base

REQUIRED = "POSTGRES_TESTS_REQUIRED"
PLACES = ("/usr/lib/postgresql/*/bin", "/usr/pgsql-*/bin", "/opt/homebrew/opt/postgresql*/bin")
START_SECONDS = 30
# It refuses to run as root.
ACCOUNTS = ("postgres", "nobody")


def programs() -> Path | None:
    """Find the folder of the newest PostgreSQL server of this machine."""
    found = [
        folder for place in PLACES for folder in Path("/").glob(place[1:]) if (folder / "initdb").exists()
    ]
    on_path = shutil.which("initdb")
    return max(found, default=Path(on_path).resolve().parent if on_path else None, key=_release)


def _release(folder: Path) -> float:
    digits = "".join(letter for letter in folder.parent.name if letter.isdigit() or letter == ".")
    return float(digits or 0)


class PostgresServer:
    """A server that listens to a socket in its folder alone. What it keeps need not outlast the machine.

    Parameters
    ----------
    programs
        Folder of ``initdb`` and ``postgres``.
    """

    def __init__(self, programs: Path) -> None:
        self._programs = programs
        # The path of a socket has about 100 letters at most: that of pytest's folders is too long.
        self.folder = Path(tempfile.mkdtemp(prefix="pg-"))
        self._account: dict[str, Any] = {}
        if os.geteuid() == 0:
            account = next(found for found in pwd.getpwall() if found.pw_name in ACCOUNTS)
            os.chown(self.folder, account.pw_uid, account.pw_gid)
            self._account = {"user": account.pw_uid, "group": account.pw_gid, "extra_groups": []}
        self._numbers = itertools.count()
        self._used: str | None = None
        options = ("--username=postgres", "--auth=trust", "--encoding=UTF8", "--locale=C", "--no-sync")
        self._call("initdb", "--pgdata", str(self.folder / "data"), *options)
        self.start()

    def start(self) -> None:
        """Start it, and wait until it answers."""
        options = f"-c listen_addresses= -c unix_socket_directories={self.folder} -c fsync=off"
        self._control("start", "--log", str(self.folder / "log"), "--options", options)

    def stop(self) -> None:
        """End all connections and the server; what was committed is kept."""
        self._control("stop", "--mode", "fast")

    def database(self) -> str:
        """Make an empty database and return its URL."""
        name = f"test{next(self._numbers)}"
        engine = create_engine(self._url("postgres"), isolation_level="AUTOCOMMIT")
        with engine.connect() as connection:
            connection.execute(text(f"CREATE DATABASE {name}"))
        engine.dispose()
        return self._url(name)

    def emptied(self) -> Database:
        """Open a database that has the tables of this version and nothing in them, the same every time."""
        if self._used is None:
            self._used = self.database()
            database = Database(self._used)
            upgrade(database)
            return database
        database = Database(self._used)
        with database.writing() as session:
            tables = ", ".join(set(Base.metadata.tables) - {"leader"})
            session.execute(text(f"TRUNCATE {tables} RESTART IDENTITY CASCADE"))
            session.execute(text("UPDATE leader SET server = NULL, folder = NULL"))
        return database

    def close(self) -> None:
        """Stop it and remove all that it has kept."""
        self._control("stop", "--mode", "immediate")
        shutil.rmtree(self.folder)

    def _url(self, name: str) -> str:
        return f"postgresql+psycopg://postgres@/{name}?host={self.folder}"

    def _control(self, *words: str) -> None:
        self._call("pg_ctl", "--pgdata", str(self.folder / "data"), "--wait", *words)

    def _call(self, program: str, *words: str) -> None:
        # A server that keeps the pipe of its standard output open would keep its starter waiting.
        with (self.folder / "calls").open("ab") as told:
            ended = subprocess.run(
                [self._programs / program, *words],
                check=False,
                stdout=told,
                stderr=told,
                cwd=self.folder,
                timeout=START_SECONDS,
                **self._account,
            )
        assert ended.returncode == 0, (self.folder / "calls").read_text()
