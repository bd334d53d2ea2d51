"""Events of a render in progress, and its result."""

import os
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from renderer.film import Image
from renderer.images.files import layer_path, write_image, write_layer
from renderer.layers import Layers
from schemas.scene import Display
from schemas.tiles import Pass, Tile


@dataclass(frozen=True, slots=True, eq=False)
class TileEvent:
    """A finished tile of a pass.

    Attributes
    ----------
    tile : Tile
    pass_ : Pass
    pixels : (h, w, 3) float32
        The mean over all samples so far; the preview is enlarged to full size.
    done, total : int
        Tiles of all passes; for target quality `total` is how many are expected, with `share` of them done.
    share : float
        Part of the work that is done, 0 to 1. It never falls. For target quality it is estimated, and below
        1 until the picture is returned.
    remaining_seconds : float or None
        Expected time for the rest; None before anything is known.
    """

    tile: Tile
    pass_: Pass
    pixels: Image
    done: int
    total: int
    share: float
    remaining_seconds: float | None


@dataclass(frozen=True, slots=True, eq=False, repr=False)
class RenderResult:
    """A finished picture.

    Attributes
    ----------
    image : (H, W, 3) float32
        Linear radiance.
    layers : dict of str to (H, W) or (H, W, channels) array
        Values of each pixel beside its colour; float32 or int32.
    report : dict
        Seconds, rays, work, samples, numerics and the plan, as `penumbra render --json` prints them.
    display : schemas.scene.Display
        The scene's exposure and transfer function for a PNG.
    """

    image: NDArray[np.float32]
    layers: Layers
    report: dict[str, Any]
    display: Display = field(default_factory=Display)

    def __repr__(self) -> str:
        """Size, layers and cost in one line: arrays and the report have thousands."""
        height, width = self.image.shape[:2]
        layers = f", layers {', '.join(self.layers)}" if self.layers else ""
        seconds = self.report.get("seconds")
        cost = "" if seconds is None else f", {seconds:.2f} s"
        return f"<RenderResult {width} x {height}{layers}{cost}>"

    def save(self, path: str | os.PathLike[str]) -> None:
        """Write the picture as .png, .npy or .exr, and each layer beside it as ``<path>.<layer>.npy``.

        Raises
        ------
        ImageFileError
            If the ending is not known, or a file cannot be written.
        MissingExtraError
            If the library for .exr is not installed.
        """
        target = Path(path)
        write_image(target, self.image, self.display, self.layers)
        for name, values in self.layers.items():
            write_layer(layer_path(target, name), values)
