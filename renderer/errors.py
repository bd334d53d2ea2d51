"""The exceptions of rendering.

SceneError (schemas)   a scene, or a file it names, cannot be used
RenderError            a scene that was accepted could not be rendered
  ImageFileError       a picture could not be written or read
  MissingExtraError    a package is not installed
"""

from collections.abc import Iterator
from contextlib import contextmanager

from schemas.errors import SceneError
from schemas.tiles import Tile

__all__ = ["ImageFileError", "MissingExtraError", "RenderError", "SceneError", "tile_errors"]


class RenderError(RuntimeError):
    """A scene that was accepted could not be rendered; the message says where and how to repeat it."""


class ImageFileError(RenderError):
    """A picture could not be written or read."""


class MissingExtraError(RenderError):
    """A package is not installed that a file or a metric needs; the message says how to install it."""


@contextmanager
def tile_errors(seed: int, tile: Tile, what: str) -> Iterator[None]:
    """Name the pixels, samples and seed that an error of arithmetic or memory came from."""
    try:
        yield
    except (ArithmeticError, MemoryError, ValueError) as error:
        place = f"pixels {tile.x0}..{tile.x1} x {tile.y0}..{tile.y1}, {what}"
        raise RenderError(f"{place}, seed {seed}: {type(error).__name__}: {error}") from error
