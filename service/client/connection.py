# Generated from async_connection.py by tools/generate_sync_client.py: edit that file, then run this script.
"""The connection of the synchronous client: sends calls and waits for responses."""

from __future__ import annotations

import time
from collections.abc import Iterator
from contextlib import closing, contextmanager
from types import TracebackType
from typing import Self

import httpx2

from service.client.access import access
from service.client.calls import LONGEST_SECONDS, Answer, Call, checked_seconds
from service.client.errors import ClientError
from service.client.exchange import Tries, check, refuse_closed, transport_errors
from service.client.flows import Flow, Result


class Connection:
    """Transport of a client's calls, with the parameters and errors of :class:`Client`."""

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
        self._http = httpx2.Client(base_url=found.server, headers=found.headers, timeout=self._timeout)

    def __repr__(self) -> str:
        return f"{type(self).__name__}({self.server!r})"

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, traceback: TracebackType | None
    ) -> None:
        self.close()

    def close(self) -> None:
        """Close all connections."""
        self._http.close()

    @contextmanager
    def _stream(self, call: Call[Answer]) -> Iterator[Answer]:
        """Send a call whose answer is a stream; the connection is closed at the end of the block."""
        refuse_closed(self._http.is_closed)
        with transport_errors(self.server, job_id=call.job_id):
            with self._http.stream(call.method, call.path, headers=dict(call.headers)) as answer:
                if not answer.is_success:
                    answer.read()
                yield call.read(check(answer, call))

    def _run(self, flow: Flow[Result]) -> Result:
        """Send what a flow asks for until it has its result."""
        with closing(flow):
            try:
                call = next(flow)
                while True:
                    try:
                        answer = self._send(call)
                    except ClientError as error:
                        call = flow.throw(error)
                    else:
                        call = flow.send(answer)
            except StopIteration as end:
                result: Result = end.value
                return result

    def _send(self, call: Call[Answer]) -> Answer:
        tries = Tries(call, LONGEST_SECONDS if self._retry_seconds is None else self._retry_seconds)
        while True:
            try:
                return self._send_once(call)
            except ClientError as error:
                time.sleep(tries.pause_after(error))

    def _send_once(self, call: Call[Answer]) -> Answer:
        refuse_closed(self._http.is_closed)
        with transport_errors(self.server, job_id=call.job_id):
            answer = self._http.request(**call.request(self._timeout))
        return call.read(check(answer, call))
