"""Passes and tiles of renders of target quality, as the ledger numbers them and workers name them."""

from __future__ import annotations

from dataclasses import replace

from renderer import tiling
from schemas.tiles import Pass, Tile

WHOLE = 0
"""Number of the tile that is the whole picture."""


def pass_of(index: int) -> Pass:
    """Make a pass. How many samples it takes differs from pixel to pixel; in the first one they begin."""
    return Pass(index=index, stride=1, first=min(index, 1), last=1)


def tiles(picture: tiling.Picture, tile_size: int) -> list[Tile]:
    """Give the tiles of a picture with the numbers that they have here."""
    return [replace(tile, index=tile.index + 1) for tile in tiling.tiles(picture, pass_of(0), tile_size)]
