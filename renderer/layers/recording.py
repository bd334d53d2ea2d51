"""Filling the layers of a tile that do not come from its camera samples."""

from collections.abc import Callable, Sequence

from renderer.interaction import Points
from renderer.layers.layer import Layer, Layers
from renderer.tiling import Block, blocks
from schemas.tiles import Pass, Tile

CENTRES = Pass(index=0, stride=1, first=0, last=1)
"""One ray a pixel."""


def record(layers: Sequence[Layer], tile: Tile, points_in: Callable[[Block], Points]) -> Layers:
    """Fill the layers of a tile.

    Parameters
    ----------
    layers : sequence of Layer
    tile : Tile
    points_in : callable
        From a block to the points that the rays through the centres of its pixels meet, one ray a pixel.
        Called only if some layer needs them.
    """
    sheets = {layer.name: layer.blank(tile.height, tile.width) for layer in layers if layer.statistic is None}
    wanted = [(sheets[layer.name], layer.values) for layer in layers if layer.values is not None]
    for block in blocks(tile, CENTRES) if wanted else ():
        points = points_in(block)
        columns, rows = block.columns[points.rays] - tile.x0, block.rows[points.rays] - tile.y0
        for sheet, values in wanted:
            sheet[rows, columns] = values(points).T
    return sheets
