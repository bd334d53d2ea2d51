"""Layers: numbers about each pixel besides its colour.

Most come from the one ray through the pixel's centre, those that are `sampled` from all camera samples.
"""

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from operator import attrgetter
from typing import Any

import numpy as np
from numpy.typing import NDArray

from renderer.film import BRIGHTEST, Image
from renderer.interaction import MISS, Points
from renderer.math.arrays import Floats, Integers, lengths
from renderer.tiling import Block, blocks
from schemas.tiles import Pass, Tile

Layers = dict[str, NDArray[Any]]
"""Layers by name, each (H, W) or (H, W, channels), float32 or int32; or the records of a tile for them."""


@dataclass(frozen=True, slots=True, eq=False)
class Layer:
    """One number, or a few, about each pixel.

    Attributes
    ----------
    name, detail : str
    channels : tuple of str
        Names of its numbers. With one channel the layer has shape (H, W), else (H, W, channels).
    dtype : float32 or int32
    ground : float
        Value of a pixel whose ray hits no shape.
    values : callable or None
        From points (M) to their values, (M,) or (channels, M). None if every pixel has the value `ground`,
        or is formed from the camera samples, so that no ray is needed.
    sampled : bool
        Whether it is formed from the variance of all camera samples. Then every pass records it, otherwise
        only the first.
    """

    name: str
    detail: str
    channels: tuple[str, ...]
    dtype: np.dtype[Any]
    ground: float
    values: Callable[[Points], NDArray[Any]] | None = None
    sampled: bool = False

    def recorded_in(self, pass_: Pass) -> bool:
        """Whether a pass records something for it."""
        return pass_.stride == 1 if self.sampled else pass_.begins

    def blank(self, height: int, width: int) -> NDArray[Any]:
        """The layer of a picture that shows no shape."""
        shape = (height, width) if len(self.channels) == 1 else (height, width, len(self.channels))
        return np.full(shape, self.ground, dtype=self.dtype)


MEANS, SQUARES, COUNTS = slice(0, 3), slice(3, 6), 6
"""Places in a record (7, h, w) float64."""


class Moments:
    """Records mean and variance of the samples of each pixel of a tile in one pass.

    A record holds the mean of a pixel's samples, the sum of squares about it, and their number. It is formed
    from differences to the pixel's first sample, and records merge by Chan, Golub and LeVeque (1979), so that
    nothing cancels, and a pixel whose samples are all equal has an error of exactly 0.

    Parameters
    ----------
    tile : Tile
    pass_ : Pass
        Not the preview.
    """

    def __init__(self, tile: Tile, pass_: Pass) -> None:
        self._tile, self._samples = tile, pass_.last - pass_.first
        self.record = np.zeros((7, tile.height, tile.width))
        self.record[COUNTS] = self._samples

    def add(self, columns: Integers, rows: Integers, radiance: Floats) -> None:
        """Take the samples (3, P * S) of P pixels, those of one pixel together, ordered by number."""
        samples = np.minimum(radiance, BRIGHTEST).reshape(3, columns.size, self._samples)
        first = samples[:, :, 0]
        total = np.zeros_like(first)
        for sample in range(1, self._samples):
            total += samples[:, :, sample] - first
        mean = first + total / self._samples
        squares = np.zeros_like(first)
        for sample in range(self._samples):
            squares += (samples[:, :, sample] - mean) ** 2
        x, y = columns - self._tile.x0, rows - self._tile.y0
        self.record[MEANS, y, x], self.record[SQUARES, y, x] = mean, squares


def merged(one: Floats, other: Floats) -> Floats:
    """The record of the samples of both, in this order."""
    count = one[COUNTS] + other[COUNTS]
    share = other[COUNTS] / count
    apart = other[MEANS] - one[MEANS]
    squares = one[SQUARES] + other[SQUARES] + apart * apart * (one[COUNTS] * share)
    return np.concatenate((one[MEANS] + apart * share, squares, count[None]))


def standard_errors(record: Floats) -> Image:
    """Estimated standard errors of the means, (h, w, 3): sqrt(squares / (n (n - 1))), inf if n < 2."""
    count = record[COUNTS]
    variances = np.full_like(record[SQUARES], np.inf)
    np.divide(record[SQUARES], count * (count - 1), out=variances, where=count > 1)
    return np.sqrt(variances).transpose(1, 2, 0).astype(np.float32)


REAL, WHOLE = np.dtype(np.float32), np.dtype(np.int32)
XYZ, RGB, UV, ID = ("X", "Y", "Z"), ("R", "G", "B"), ("U", "V"), ("id",)


def depth(points: Points) -> Floats:
    """Distance from the camera, (M,) scene units."""
    return points.t * lengths(points.directions)


TABLE = (
    Layer("depth", "distances from the camera", ("Z",), REAL, np.inf, depth),
    Layer("position", "places in the world", XYZ, REAL, np.nan, attrgetter("positions")),
    Layer("normal", "geometric normals on the camera's side", XYZ, REAL, np.nan, attrgetter("normals")),
    Layer("shading_normal", "normals that shading uses", XYZ, REAL, np.nan, attrgetter("shading_normals")),
    Layer("albedo", "colours of surfaces", RGB, REAL, 0.0, attrgetter("colors")),
    Layer("uv", "texture coordinates", UV, REAL, np.nan, attrgetter("coordinates")),
    Layer("shape", "indices into the scene's shapes", ID, WHOLE, MISS, attrgetter("shapes")),
    Layer("primitive", "triangles within meshes", ID, WHOLE, 0, attrgetter("primitives")),
    Layer("samples", "camera samples of each pixel", ("count",), WHOLE, 0),
    Layer("error", "estimated standard errors of the pixels", RGB, REAL, np.inf, sampled=True),
)

LAYERS = {layer.name: layer for layer in TABLE}
"""Every layer by its name. The ground of `samples` is filled in when a plan is made."""


CENTRE_PASS = Pass(index=0, stride=1, first=0, last=1)
"""One ray a pixel."""


def record(layers: Sequence[Layer], tile: Tile, points_in: Callable[[Block], Points]) -> Layers:
    """Fill the layers of a tile.

    Parameters
    ----------
    layers : sequence of Layer
    tile : Tile
    points_in : callable
        From a block to the points that the rays through the centres of its pixels hit, one ray a pixel.
        Called only if some layer needs them.
    """
    sheets = {layer.name: layer.blank(tile.height, tile.width) for layer in layers if not layer.sampled}
    wanted = [(sheets[layer.name], layer.values) for layer in layers if layer.values is not None]
    for block in blocks(tile, CENTRE_PASS) if wanted else ():
        points = points_in(block)
        columns, rows = block.columns[points.rays] - tile.x0, block.rows[points.rays] - tile.y0
        for sheet, values in wanted:
            sheet[rows, columns] = values(points).T
    return sheets


class LayerBuffers:
    """Collects the records of tiles, which come in any order, each with its passes in order.

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
        """Add the records of a tile in a pass."""
        for name, record in records.items():
            if name not in self._layers:
                continue
            if self._layers[name].sampled:
                before = self._open.get((tile, name))
                self._open[tile, name] = record if before is None else merged(before, record)
            else:
                self._buffers[name][tile.y0 : tile.y1, tile.x0 : tile.x1] = record

    def settle(self) -> None:
        """Form the layers of the tiles so far, of which no more passes follow, and forget their records."""
        for (tile, name), record in self._open.items():
            self._buffers[name][tile.y0 : tile.y1, tile.x0 : tile.x1] = standard_errors(record)
        self._open.clear()

    def finished(self) -> Layers:
        """The layers; pixels that are not recorded have the values of those that show no shape."""
        self.settle()
        return self._buffers
