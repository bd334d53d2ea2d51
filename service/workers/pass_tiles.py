"""Passes and tiles of renders of target quality, as the ledger numbers them and workers name them."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import replace

from schemas.tiles import Pass, Tile

WHOLE = 0
"""Number of the tile that is the whole picture."""


def pass_of(index: int) -> Pass:
    """Make a pass. How many samples it takes differs from pixel to pixel; in the first one they begin."""
    return Pass(index=index, stride=1, first=min(index, 1), last=1)


def numbered(tiles: Iterable[Tile]) -> list[Tile]:
    """Give the tiles of a pass the numbers that they have here."""
    return [replace(tile, index=number) for number, tile in enumerate(tiles, WHOLE + 1)]
