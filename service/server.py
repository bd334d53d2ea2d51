"""Running the service: in this process, or in one of its own."""

from __future__ import annotations

import errno
import math
import os
import resource
import socket
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import IO, TYPE_CHECKING

import structlog
import uvicorn
from fastapi import FastAPI
from uvicorn.config import STARTUP_FAILURE

from service import logs
from service.access.hosts import is_loopback
from service.access.keys import any_made
from service.api.connections import connection_type
from service.api.middleware import RequestIds, SafeHeaders
from service.app import create_app
from service.errors import UnavailableError
from service.jobs.context import Service
from service.settings import UNLIMITED, WITHOUT_LIMIT, Settings
from service.start_errors import NoKeysError, OpenFilesError, PortTakenError
from service.storage import ownership
from service.storage.database.connection import Database
from service.storage.database.migrations import upgrade
from service.storage.database.urls import is_shared
from service.storage.folder import place_of
from service.storage.opening import OPENING_ERRORS, reason
from service.storage.reserve import Reserve
from service.workers.engines import check_engine

if TYPE_CHECKING:
    import httpx2

# Requests in progress have this long to end when the service stops, seconds. Watchers are sent away at once.
FAREWELL_SECONDS = 5
START_SECONDS = 60.0
STOP_SECONDS = 30.0
POLL_SECONDS = 0.02
# Two pipes of each worker, and their far ends while it is started.
WORKER_FILES = 4
# 64 connections of the database with 2 files each, a picture in each of 40 threads, and as many for the rest.
OTHER_FILES = 256

log = structlog.get_logger()


class _Server(uvicorn.Server):
    """Ends event streams before it waits for requests to end: they would last for ever."""

    def __init__(self, config: uvicorn.Config, app: FastAPI) -> None:
        super().__init__(config)
        self._app = app

    async def startup(self, sockets: list[socket.socket] | None = None) -> None:
        await super().startup(sockets)
        for listener in (listener for server in self.servers for listener in server.sockets):
            host, port, *_ = listener.getsockname()
            log.info("listening", url=f"http://{host}:{port}")

    async def shutdown(self, sockets: list[socket.socket] | None = None) -> None:
        service: Service = self._app.state.service
        service.job_events.close()
        await super().shutdown(sockets)


def run(settings: Settings, listener: socket.socket | None = None) -> None:
    """Serve until a signal ends it: SIGTERM and SIGINT let requests in progress end first.

    Parameters
    ----------
    listener
        Socket to serve at; by default one is bound to the host and the port of the settings.

    Raises
    ------
    SystemExit
        If it cannot start; the log says why.
    """
    logs.configure(settings.log_level)
    with ExitStack() as stack:
        try:
            _raise_open_files(settings)
            shared = is_shared(settings.database_url)
            stack.enter_context(ownership.held(settings.data, shared=shared))
            keys_made = _prepare_database(settings)
            check_engine(settings, keys_made=keys_made)
            if listener is None:
                _check_port(settings.host, settings.port)
        except OPENING_ERRORS as error:
            log.error("not started", reason=reason(error, settings.data))  # noqa: TRY400  (the reason is enough)
            raise SystemExit(STARTUP_FAILURE) from None
        _serve(settings, listener)


def _raise_open_files(settings: Settings) -> None:
    """Raise the limit of open files as far as the system allows; raise an error if it is too low.

    Beyond the limit nothing could be accepted, read or written: one user's connections would stop everyone.
    """
    needed = settings.max_connections + WORKER_FILES * settings.workers + OTHER_FILES
    limit, most = resource.getrlimit(resource.RLIMIT_NOFILE)
    # macOS does not accept an unlimited one.
    limit = max(limit, needed) if most == resource.RLIM_INFINITY else most
    if limit < needed:
        raise OpenFilesError(limit, needed)
    resource.setrlimit(resource.RLIMIT_NOFILE, (limit, most))


def _check_port(host: str, port: int) -> None:
    """Report a port in use, which the HTTP server would report only in the system's words."""
    try:
        addresses = socket.getaddrinfo(host, port, type=socket.SOCK_STREAM)
    except socket.gaierror:
        # The HTTP server reports an unknown host.
        return
    if any(_is_taken(family, address) for family, _, _, _, address in addresses):
        raise PortTakenError(host, port)


def _is_taken(family: int, address: tuple[object, ...]) -> bool:
    """Whether another program listens there: bind to it for a moment, as the HTTP server will."""
    try:
        with socket.socket(family, socket.SOCK_STREAM) as probe:
            probe.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
            if family == socket.AF_INET6:
                probe.setsockopt(socket.IPPROTO_IPV6, socket.IPV6_V6ONLY, 1)
            probe.bind(address)
    except OSError as error:
        return error.errno == errno.EADDRINUSE
    return False


def _prepare_database(settings: Settings) -> bool:
    """Bring the database to this version, and require keys if the service is reachable from outside.

    Returns
    -------
    bool
        Whether there are keys.
    """
    database = Database(settings.database_url)
    try:
        # After a service has ended by itself SQLite needs room to open a database; retention takes it back.
        if Reserve(settings.data, database).give_up():
            log.warning("disk nearly full", folder=str(settings.data))
        upgrade(database)
        if database.shared or settings.store:
            place = place_of(settings.place)
            place.check()
            ownership.check(database, place)
        with database.reading() as session:
            keys_made = any_made(session)
    finally:
        database.close()
    if not (keys_made or settings.behind_proxy or is_loopback(settings.host)):
        raise NoKeysError(settings.host, settings.data)
    return keys_made


def _serve(settings: Settings, listener: socket.socket | None) -> None:
    app = create_app(settings)
    config = uvicorn.Config(
        RequestIds(SafeHeaders(app)),
        host=settings.host,
        port=settings.port,
        log_config=None,
        access_log=False,
        server_header=False,
        http=connection_type(settings),
        # The timer of `service.api.connections` ends earlier, so it decides. Uvicorn's default is the 5
        # seconds for which httpx keeps an idle connection too: it would send on one that is being closed.
        timeout_keep_alive=math.ceil(settings.client_timeout_seconds) + 1,
        # The application knows its proxies, and whom each request came by.
        proxy_headers=False,
        timeout_graceful_shutdown=FAREWELL_SECONDS,
    )
    _Server(config, app).run(None if listener is None else [listener])


@dataclass
class RunningServer:
    """A service in a process of its own."""

    process: subprocess.Popen[bytes]
    url: str
    data: Path

    def stop(self) -> None:
        """Terminate the service and wait for its end; kill it if it does not react."""
        self.process.terminate()
        try:
            self.process.wait(STOP_SECONDS)
        except subprocess.TimeoutExpired:
            self.process.kill()
            self.process.wait()


@contextmanager
def running(
    settings: Settings,
    *,
    stderr: IO[bytes] | None = None,
    module: str = "service",
    popen: Callable[..., subprocess.Popen[bytes]] = subprocess.Popen,
) -> Iterator[RunningServer]:
    """Start a service in a process of its own, wait until it is ready, and stop it at the end.

    Its logs go to ``stderr``; by default to where those of this process go. ``module`` is what ``popen``
    runs; it serves at `inherited_listener`. This process binds that socket: a port that is free now may be
    another program's by the time that the service has imported what it needs.

    Raises
    ------
    PortTakenError
        If another program listens at the port.
    UnavailableError
        If it ends at once or is not ready within a minute; what it wrote is on stderr.
    """
    with _listen(settings.host, settings.port) as listener:
        port = listener.getsockname()[1]
        environment = os.environ | _environment(settings.model_copy(update={"port": port}))
        handle = listener.fileno()
        command = [sys.executable, "-m", module, str(handle)]
        process = popen(command, env=environment, stderr=stderr, pass_fds=[handle])
    server = RunningServer(process, f"http://{settings.host}:{port}", settings.data)
    try:
        _wait_until_ready(server)
        yield server
    finally:
        server.stop()


def _listen(host: str, port: int) -> socket.socket:
    """Bind a port, or any free one for 0."""
    try:
        return socket.create_server((host, port), family=socket.AF_INET6 if ":" in host else socket.AF_INET)
    except OSError as error:
        if error.errno == errno.EADDRINUSE:
            raise PortTakenError(host, port) from None
        raise


def _environment(settings: Settings) -> dict[str, str]:
    """Write settings as environment variables for another process."""
    document = settings.model_dump(mode="json", exclude={"limits"})
    document |= {name: UNLIMITED for name in WITHOUT_LIMIT if document[name] is None}
    limits = settings.model_dump(mode="json", include={"limits"})["limits"]
    return {
        f"PENUMBRA_{name.upper()}": str(value) for name, value in document.items() if value is not None
    } | {f"PENUMBRA_LIMITS__{name.upper()}": str(value) for name, value in limits.items()}


def inherited_listener() -> socket.socket | None:
    """The socket passed by `running`; None if this process was started otherwise."""
    return socket.socket(fileno=int(sys.argv[1])) if len(sys.argv) > 1 else None


def is_ready(client: httpx2.Client) -> bool:
    """Whether a service answers that it can render."""
    import httpx2  # noqa: PLC0415  (only clients of a service need it)

    try:
        return client.get("/readyz", timeout=1.0).status_code == 200
    except httpx2.TransportError:
        return False


def _wait_until_ready(server: RunningServer) -> None:
    import httpx2  # noqa: PLC0415  (as above)

    deadline = time.monotonic() + START_SECONDS
    # One client for all requests: setting up TLS takes 40 ms of a processor that the start needs itself.
    with httpx2.Client(base_url=server.url) as client:
        while time.monotonic() < deadline:
            if server.process.poll() is not None:
                code = server.process.returncode
                raise UnavailableError(f"The service ended with code {code} as it started.")
            if is_ready(client):
                return
            time.sleep(POLL_SECONDS)
    raise UnavailableError("The service was not ready within a minute.")
