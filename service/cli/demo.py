"""``penumbra demo``."""

from __future__ import annotations


def demo() -> None:
    """Start a service, render a scene of the gallery over HTTP, save the picture, stop everything."""
