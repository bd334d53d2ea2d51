"""A PostgreSQL server for the tests, run by this machine's programs in a temporary folder."""

import itertools
import os
import pwd
import shutil
import signal
import subprocess
import tempfile
import time
from pathlib import Path
from typing import Any

from sqlalchemy import create_engine, text

from service.storage.database.connection import Database
from service.storage.database.migrations import upgrade
from service.storage.database.models import Base

PLACES = ("/usr/lib/postgresql/*/bin", "/usr/pgsql-*/bin", "/opt/homebrew/opt/postgresql*/bin")
START_SECONDS = 30
# It refuses to run as root.
ACCOUNTS = ("postgres", "nobody")
LEASH = ("setpriv", "--pdeathsig", "INT") if shutil.which("setpriv") else ()
"""Has Linux end a program when the process that has started it is gone."""


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

    On Linux it ends with the thread that has started it, even where that is killed.

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
        options = ("listen_addresses=", f"unix_socket_directories={self.folder}", "fsync=off")
        words = [str(self.folder / "data"), *(word for option in options for word in ("-c", option))]
        with (self.folder / "log").open("ab") as log:
            self._process = subprocess.Popen(
                [*LEASH, self._programs / "postgres", "-D", *words],
                stdout=log,
                stderr=log,
                cwd=self.folder,
                **self._account,
            )
        deadline = time.monotonic() + START_SECONDS
        while not self._answers():
            assert self._process.poll() is None, (self.folder / "log").read_text()
            assert time.monotonic() < deadline, "it did not answer in time"
            time.sleep(0.05)

    def stop(self) -> None:
        """End all connections and the server; what was committed is kept."""
        self._end(signal.SIGINT)

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
        self._end(signal.SIGQUIT)
        shutil.rmtree(self.folder)

    def _url(self, name: str) -> str:
        return f"postgresql+psycopg://postgres@/{name}?host={self.folder}"

    def _answers(self) -> bool:
        asked = [self._programs / "pg_isready", "--quiet", "--host", self.folder]
        return subprocess.run(asked, check=False, timeout=START_SECONDS).returncode == 0

    def _end(self, how: signal.Signals) -> None:
        self._process.send_signal(how)
        self._process.wait(START_SECONDS)

    def _call(self, program: str, *words: str) -> None:
        with (self.folder / "calls").open("ab") as output:
            ended = subprocess.run(
                [self._programs / program, *words],
                check=False,
                stdout=output,
                stderr=output,
                cwd=self.folder,
                timeout=START_SECONDS,
                **self._account,
            )
        assert ended.returncode == 0, (self.folder / "calls").read_text()
