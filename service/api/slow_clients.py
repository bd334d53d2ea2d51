"""Connections that send no request: they are closed, so that a few clients cannot hold all that there may be.

Uvicorn has no such limit. Its ``timeout_keep_alive`` begins with the end of an answer, so it never closes a
connection that has sent nothing yet, and it ends with the next byte; ``h11_max_incomplete_event_size`` bounds
the bytes of a head, and not how long it takes to come.
"""

from __future__ import annotations

import asyncio

from uvicorn.protocols.http.h11_impl import H11Protocol, RequestResponseCycle


def slow_client_protocol(seconds: float) -> type[H11Protocol]:
    """Make a protocol that closes a connection on which no head of a request is complete after so long.

    Parameters
    ----------
    seconds
        From the beginning of the connection, or from the end of the answer before.
    """

    class SlowClientProtocol(H11Protocol):
        _timer: asyncio.TimerHandle | None = None

        def connection_made(self, transport: asyncio.Transport) -> None:  # type: ignore[override]
            super().connection_made(transport)
            self._start()

        def connection_lost(self, exc: Exception | None) -> None:
            super().connection_lost(exc)
            self._stop()

        def on_response_complete(self) -> None:
            super().on_response_complete()
            self._start()

        def _start(self) -> None:
            self._stop()
            self._timer = self.loop.call_later(seconds, self._close_if_idle)

        def _stop(self) -> None:
            if self._timer is not None:
                self._timer.cancel()

        def _close_if_idle(self) -> None:
            cycle: RequestResponseCycle | None = self.cycle
            if (cycle is None or cycle.response_complete) and not self.transport.is_closing():
                self.transport.close()

    return SlowClientProtocol
