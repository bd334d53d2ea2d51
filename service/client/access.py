"""The address of the service and its key: from arguments, or from the environment."""

from __future__ import annotations

import os
from dataclasses import dataclass, field

import httpx2

from service.client.errors import ClientError, UnreachableError

DEFAULT_SERVER = "http://127.0.0.1:8000"
SERVER_VARIABLE = "PENUMBRA_SERVER"
KEY_VARIABLE = "PENUMBRA_KEY"
API = "/v1"


@dataclass(frozen=True, slots=True)
class Access:
    """A service and the key to it.

    Attributes
    ----------
    server
        Its address.
    key
        None if the service needs none. It is in no message and in no ``repr``.
    """

    server: str
    key: str | None = field(default=None, repr=False)

    @property
    def headers(self) -> dict[str, str]:
        """Headers of every request."""
        return {} if self.key is None else {"Authorization": f"Bearer {self.key}"}


def access(server: str | None = None, key: str | None = None) -> Access:
    """Find the service: as named, else by ``PENUMBRA_SERVER`` and ``PENUMBRA_KEY``.

    Raises
    ------
    UnreachableError
        The address cannot be that of a server.
    ClientError
        The key cannot be sent.
    """
    named = server or os.environ.get(SERVER_VARIABLE) or DEFAULT_SERVER
    return Access(checked_address(named), _checked_key(key or os.environ.get(KEY_VARIABLE) or None))


def checked_address(server: str) -> str:
    """The address of a service, as its pages or its API may be called: ``/`` and ``/v1`` at the end go.

    Raises
    ------
    UnreachableError
        It cannot be the address of a server.

    Examples
    --------
    >>> checked_address("http://127.0.0.1:8000/v1/")
    'http://127.0.0.1:8000'
    """
    try:
        url = httpx2.URL(server)
    except httpx2.InvalidURL:
        url = httpx2.URL()
    if url.scheme not in {"http", "https"} or not url.host or url.query or url.fragment:
        raise UnreachableError(
            f"{server!r} is not the address of a server. Write it like http://127.0.0.1:8000."
        )
    # Paths of the API begin with it, and must not have it twice.
    return server.rstrip("/").removesuffix(API).rstrip("/")


def _checked_key(key: str | None) -> str | None:
    # A key that was read from a file often has a line end, which a header cannot hold.
    if key is not None and not (key.isascii() and key.isprintable() and " " not in key):
        raise ClientError(
            "The key has a character that no key has: a space, a line break, or one outside ASCII. "
            f"Give it as the service's operator wrote it, or in {KEY_VARIABLE}."
        )
    return key
