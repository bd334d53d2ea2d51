"""Layers of a whole picture, put together from what its tiles have recorded."""

from collections.abc import Iterable
from typing import TYPE_CHECKING

from renderer.layers.layer import Layer, Layers
from schemas.tiles import Tile

if TYPE_CHECKING:
    from renderer.math.arrays import Floats


class LayerBuffers:
    """Takes what tiles have recorded: tiles in any order, the passes of each in theirs.

    Parameters
    ----------
    layers : iterable of Layer
    height, width : int
        Of the picture, pixels.
    """

    def __init__(self, layers: Iterable[Layer], height: int, width: int) -> None:
        self._layers = {layer.name: layer for layer in layers}
        self._buffers = {name: layer.blank(height, width) for name, layer in self._layers.items()}
        self._open: dict[tuple[Tile, str], Floats] = {}

    def take(self, tile: Tile, records: Layers) -> None:
        """Add what a tile has recorded in a pass."""
        for name, record in records.items():
            statistic = self._layers[name].statistic if name in self._layers else None
            if statistic is not None:
                before = self._open.get((tile, name))
                self._open[tile, name] = record if before is None else statistic.merged(before, record)
            elif name in self._layers:
                self._buffers[name][tile.y0 : tile.y1, tile.x0 : tile.x1] = record

    def settle(self) -> None:
        """Form the layers of the tiles so far, of which no more passes follow, and forget their records."""
        for (tile, name), record in self._open.items():
            statistic = self._layers[name].statistic
            assert statistic is not None
            self._buffers[name][tile.y0 : tile.y1, tile.x0 : tile.x1] = statistic.finished(record)
        self._open.clear()

    def finished(self) -> Layers:
        """The layers; pixels that are not recorded look like those that show no shape."""
        self.settle()
        return self._buffers
