"""Errors that prevent the export of a result to a platform."""

from __future__ import annotations


class ExportError(Exception):
    """A value that the platform requires is unknown; the message names it and says how to set it."""
