"""The connection of the asynchronous client: sends calls and waits for responses."""

from __future__ import annotations

import asyncio
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager, closing
from types import TracebackType
from typing import Self

import httpx2

from service.client.access import access
from service.client.calls import LONGEST_SECONDS, Answer, Call, checked_seconds
from service.client.errors import ClientError
from service.client.exchange import Tries, check, refuse_closed, transport_errors
from service.client.flows import Flow, Result


class AsyncConnection:
    """Transport of a client's calls, with the parameters and errors of :class:`AsyncClient`."""

    def __init__(
        self,
        server: str | None = None,
        *,
        key: str | None = None,
        timeout: float | None = 30.0,
        retry_seconds: float | None = 5.0,
    ) -> None:
        found = access(server, key)
        self.server = found.server
        self._timeout = checked_seconds("timeout", timeout)
        self._retry_seconds = checked_seconds("retry_seconds", retry_seconds)
        self._http = httpx2.AsyncClient(base_url=found.server, headers=found.headers, timeout=self._timeout)

    def __repr__(self) -> str:
        return f"{type(self).__name__}({self.server!r})"

    async def __aenter__(self) -> Self:
        return self

    async def __aexit__(
        self, kind: type[BaseException] | None, error: BaseException | None, traceback: TracebackType | None
    ) -> None:
        await self.close()

    async def close(self) -> None:
        """Close all connections."""
        await self._http.aclose()

    @asynccontextmanager
    async def _stream(self, call: Call[Answer]) -> AsyncIterator[Answer]:
        """Send a call whose answer is a stream; the connection is closed at the end of the block."""
        refuse_closed(self._http.is_closed)
        with transport_errors(self.server, job_id=call.job_id):
            async with self._http.stream(call.method, call.path, headers=dict(call.headers)) as answer:
                if not answer.is_success:
                    await answer.aread()
                yield call.read(check(answer, call))

    async def _run(self, flow: Flow[Result]) -> Result:
        """Send what a flow asks for until it has its result."""
        with closing(flow):
            try:
                call = next(flow)
                while True:
                    try:
                        answer = await self._send(call)
                    except ClientError as error:
                        call = flow.throw(error)
                    else:
                        call = flow.send(answer)
            except StopIteration as end:
                result: Result = end.value
                return result

    async def _send(self, call: Call[Answer]) -> Answer:
        tries = Tries(call, LONGEST_SECONDS if self._retry_seconds is None else self._retry_seconds)
        while True:
            try:
                return await self._send_once(call)
            except ClientError as error:
                await asyncio.sleep(tries.pause_after(error))

    async def _send_once(self, call: Call[Answer]) -> Answer:
        refuse_closed(self._http.is_closed)
        with transport_errors(self.server, job_id=call.job_id):
            answer = await self._http.request(**call.request(self._timeout))
        return call.read(check(answer, call))
