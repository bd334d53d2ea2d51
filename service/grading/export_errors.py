"""Why a result has no form for some platform."""

from __future__ import annotations


class ExportError(Exception):
    """Something that the platform asks for is not known; the message says what, and how to tell it."""
