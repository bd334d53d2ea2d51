"""Connections that send nothing: they are given up, so that a few clients cannot hold all there may be."""

from __future__ import annotations

import asyncio

from uvicorn.protocols.http.h11_impl import H11Protocol, RequestResponseCycle


def patient(seconds: float) -> type[H11Protocol]:
    """Make a protocol that closes a connection on which no head of a request is complete after so long.

    Parameters
    ----------
    seconds
        From the beginning of the connection, or from the end of the answer before.
    """

    class Patient(H11Protocol):
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
            self._timer = self.loop.call_later(seconds, self._look)

        def _stop(self) -> None:
            if self._timer is not None:
                self._timer.cancel()

        def _look(self) -> None:
            cycle: RequestResponseCycle | None = self.cycle
            if (cycle is None or cycle.response_complete) and not self.transport.is_closing():
                self.transport.close()

    return Patient
