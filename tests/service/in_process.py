"""The service inside the process of the tests, asked over ASGI: no socket, and no Python to start."""

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from typing import Any

import httpx2
from anyio.from_thread import BlockingPortal, start_blocking_portal
from fastapi import FastAPI

from service.api.middleware import RequestIds, SafeHeaders
from service.app import create_app
from service.jobs.context import Service
from service.settings import Settings
from tests.service.support import until


class Bridge(httpx2.BaseTransport):
    """Lets blocking clients ask an application that runs on an event loop of another thread."""

    def __init__(self, portal: BlockingPortal, app: Any, address: str = "127.0.0.1") -> None:
        self._portal, self._app = portal, app
        self._transport = httpx2.ASGITransport(app, raise_app_exceptions=False, client=(address, 1))

    def of(self, address: str) -> "Bridge":
        """The same for a client at another address."""
        return Bridge(self._portal, self._app, address)

    def handle_request(self, request: httpx2.Request) -> httpx2.Response:
        request.read()
        return self._portal.call(self._answer, request)

    async def _answer(self, request: httpx2.Request) -> httpx2.Response:
        answer = await self._transport.handle_async_request(request)
        content = b"".join([part async for part in answer.stream])
        # A server sends no body after HEAD.
        content = b"" if request.method == "HEAD" else content
        return httpx2.Response(
            answer.status_code, headers=answer.headers, stream=httpx2.ByteStream(content), request=request
        )


@dataclass(frozen=True)
class InProcess:
    """A service that runs in this process."""

    app: FastAPI
    bridge: Bridge

    @property
    def service(self) -> Service:
        return self.app.state.service

    def client(self, **options: Any) -> httpx2.Client:
        return httpx2.Client(**{"transport": self.bridge, "base_url": "http://127.0.0.1"} | options)


@contextmanager
def in_process(settings: Settings) -> Iterator[InProcess]:
    """Run a service until the block ends; it has workers of its own, as any other."""
    settings.data.mkdir(parents=True, exist_ok=True)
    app = create_app(settings)
    lifespan = app.router.lifespan_context(app)
    with start_blocking_portal() as portal, portal.wrap_async_context_manager(lifespan):
        made = InProcess(app, Bridge(portal, RequestIds(SafeHeaders(app))))
        # Not /readyz: a service whose disk is nearly full never becomes ready.
        until(made.service.dispatcher.alive, seconds=120.0)
        yield made
