"""What browsers are told about every answer: what it may load, who may show it, who may keep it."""

from __future__ import annotations

from starlette.datastructures import MutableHeaders
from starlette.types import ASGIApp, Message, Receive, Scope, Send

ALWAYS = {
    "X-Content-Type-Options": "nosniff",
    "Referrer-Policy": "no-referrer",
    "Cross-Origin-Opener-Policy": "same-origin",
    "Cross-Origin-Resource-Policy": "same-origin",
    # Plots in SVG have styles of their own. The page has a policy that lets its scripts run.
    "Content-Security-Policy": (
        "default-src 'none'; style-src 'unsafe-inline'; base-uri 'none'; form-action 'none'; "
        "frame-ancestors 'none'"
    ),
}
"""What an answer gets that does not say otherwise."""

_OF_USERS = ("/v1/", "/metrics")


class SafeHeaders:
    """Adds to each answer what browsers must know, whichever route has made it, errors included."""

    def __init__(self, app: ASGIApp) -> None:
        self.app = app

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Answer a request."""

        async def told(message: Message) -> None:
            if message["type"] == "http.response.start":
                _complete(MutableHeaders(scope=message), scope["path"])
            await send(message)

        await self.app(scope, receive, told)


def _complete(headers: MutableHeaders, path: str) -> None:
    for name, value in ALWAYS.items():
        headers.setdefault(name, value)
    if not path.startswith(_OF_USERS):
        return
    # Whom an answer is for depends on a key or a cookie: nobody keeps it for others.
    rule = headers.get("Cache-Control")
    headers["Cache-Control"] = f"private, {rule}" if rule else "no-store"
