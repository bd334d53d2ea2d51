"""Secrets: how they are made, and what is kept of them.

Keys and tokens are 256 random bits. A fast hash is right for them: slow ones are for words that people
choose, which can be guessed; these cannot.
"""

from __future__ import annotations

import hashlib
import hmac
import re
import secrets
from typing import NamedTuple

BYTES = 32
KEY = re.compile(r"pnm_([0-9a-f]{12})_([A-Za-z0-9_-]{43})", re.ASCII)


class Key(NamedTuple):
    """The two parts of an API key: a name that may be shown, and what only its owner knows."""

    id: str
    secret: str

    def __str__(self) -> str:
        return f"pnm_{self.id}_{self.secret}"


def new_key() -> Key:
    """Make a key."""
    return Key(secrets.token_hex(6), new_token())


def new_token() -> str:
    """Make a secret."""
    return secrets.token_urlsafe(BYTES)


def read_key(text: str) -> Key | None:
    """Take a key apart; None if it is none.

    >>> read_key(f"pnm_0123456789ab_{'x' * 43}").id
    '0123456789ab'
    >>> read_key("let me in")
    """
    found = KEY.fullmatch(text)
    return Key(*found.groups()) if found else None


def digest(secret: str) -> str:
    """What is kept of a secret."""
    return hashlib.sha256(secret.encode()).hexdigest()


def same(known: str, secret: str) -> bool:
    """Whether a secret has this digest; it takes as long whichever digit is the first to differ."""
    return hmac.compare_digest(known, digest(secret))
