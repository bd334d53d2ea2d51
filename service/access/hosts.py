"""Host names of a service, and the reach of an address.

A page of another site can make its own name resolve to loopback after it was loaded (DNS rebinding). The
browser then treats both as one origin, and only the host name distinguishes them.
"""

from __future__ import annotations

import ipaddress
from urllib.parse import urlsplit

from fastapi import Request

from service.errors import UnknownHostError
from service.settings import Settings


def is_loopback(host: str) -> bool:
    """Whether only programs of this machine reach a host.

    >>> is_loopback("localhost"), is_loopback("::1"), is_loopback("10.0.0.7"), is_loopback("example.org")
    (True, True, False, False)
    """
    try:
        return host == "localhost" or ipaddress.ip_address(host).is_loopback
    except ValueError:
        return False


def check_host(request: Request, settings: Settings, *, asks_for_keys: bool) -> None:
    """Refuse a request that was sent to another name than those of this service.

    With authentication no check is needed, since browsers send neither key nor cookie to another name. Behind
    a proxy the settings list the allowed names.

    Raises
    ------
    UnknownHostError
        The name is neither that of the settings nor, without authentication, loopback.
    """
    names = settings.hosts.lower().split()
    host = request.headers.get("host")
    if host is None or not (names or not (asks_for_keys or settings.behind_proxy)):
        return
    name = _name(host)
    if name not in (*names, settings.host.lower()) and not (is_loopback(name) and not settings.behind_proxy):
        raise UnknownHostError


def _name(host: str) -> str:
    try:
        return urlsplit(f"//{host}").hostname or ""
    except ValueError:
        return ""
