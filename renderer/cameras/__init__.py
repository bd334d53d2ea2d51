"""Cameras: from a place on the picture to a ray."""

from renderer.cameras.mosaic import Mosaic
from renderer.cameras.pinhole import Pinhole

__all__ = ["Mosaic", "Pinhole"]
