"""Draw the textures of the gallery and the study: painted tiles, with a normal map and a height map.

Run it with ``python -m scenes.make_textures``. It uses no random numbers, so it writes the same pixels every
time.
"""

from __future__ import annotations

import shutil
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from PIL import Image

Array = NDArray[np.float64]

FOLDER = Path(__file__).parent / "gallery" / "textures"
STUDY_FOLDER = Path(__file__).parent / "study" / "textures"
"""Scenes can only name files in their own folder, so the study has copies of these."""
STUDIED = ("tiles.png", "tiles_normal.png")
SIZE = 768
TILES = 3

GLAZE = (0.93, 0.91, 0.84)
COBALT = (0.07, 0.17, 0.47)
OCHRE = (0.83, 0.55, 0.13)
LEAF = (0.16, 0.42, 0.40)
GROUT = (0.55, 0.52, 0.47)

RELIEF = 0.055
"""Height of the ornament, relative to the side of a tile."""


def rise(x: Array, start: float, end: float) -> Array:
    """Smooth step from 0 at `start` to 1 at `end`."""
    t = np.clip((x - start) / (end - start), 0, 1)
    return t * t * (3 - 2 * t)


def band(x: Array, low: float, high: float, soft: float) -> Array:
    """1 between `low` and `high` and 0 outside, with borders of width `soft`."""
    return rise(x, low - soft, low + soft) * (1 - rise(x, high - soft, high + soft))


class Tile:
    """Masks of the parts of a tile, each (SIZE, SIZE), 0 to 1, repeated over the picture."""

    def __init__(self) -> None:
        centres = (np.arange(SIZE) + 0.5) / SIZE * TILES
        inside = centres % 1 - 0.5
        x, y = inside[None, :], -inside[:, None]
        soft = TILES / SIZE * 1.2
        radius, angle = np.hypot(x, y), np.arctan2(y, x)
        corner = np.hypot(0.5 - np.abs(x), 0.5 - np.abs(y))
        border = np.maximum(np.abs(x), np.abs(y)) + np.zeros_like(radius)
        petals = 0.17 + 0.135 * np.abs(np.cos(4 * angle))
        self.grout = rise(border, 0.482, 0.49)
        self.bevel = 1 - rise(border, 0.44, 0.485)
        self.flower = 1 - rise(radius / petals, 0.97, 1.03)
        self.vein = self.flower * band(np.abs(np.sin(4 * angle)) * radius, -1, 0.012, soft / 2)
        self.eye = 1 - rise(radius, 0.085 - soft, 0.085 + soft)
        self.ring = band(radius, 0.345, 0.375, soft)
        self.fan = band(corner, 0.10, 0.21, soft) * (1 - self.ring)
        self.corner = 1 - rise(corner, 0.075 - soft, 0.075 + soft)
        self.radius, self.petals = radius, petals
        self.corner_distance = corner


def paint(tile: Tile) -> Array:
    """Mix the colours, sRGB 0 to 1, (SIZE, SIZE, 3)."""
    layers = [
        (tile.ring, COBALT),
        (tile.fan, LEAF),
        (tile.corner, OCHRE),
        (tile.flower, COBALT),
        (0.55 * tile.vein, GLAZE),
        (tile.eye, OCHRE),
        (tile.grout, GROUT),
    ]
    color: Array = np.full((SIZE, SIZE, 3), GLAZE, dtype=np.float64)
    for mask, layer in layers:
        color = color + mask[..., None] * (np.asarray(layer, dtype=np.float64) - color)
    return color


def relief(tile: Tile) -> Array:
    """Heights of the ornament, in units of the side of a tile, (SIZE, SIZE)."""
    petal = np.sqrt(np.clip(1 - (tile.radius / tile.petals) ** 2, 0, 1))
    eye = np.sqrt(np.clip(1 - (tile.radius / 0.085) ** 2, 0, 1))
    ring = np.sqrt(np.clip(1 - ((tile.radius - 0.36) / 0.022) ** 2, 0, 1))
    fan = np.sqrt(np.clip(1 - ((tile.corner_distance - 0.155) / 0.058) ** 2, 0, 1))
    knob = np.sqrt(np.clip(1 - (tile.corner_distance / 0.078) ** 2, 0, 1))
    height: Array = 0.75 * petal + 0.7 * eye + 0.3 * ring + 0.35 * fan * (1 - ring) + 0.45 * knob
    raised: Array = RELIEF * (height + 0.7 * tile.bevel)
    return raised


def normals(height: Array) -> Array:
    """Turn heights into normals in (tangent, cotangent, normal), (SIZE, SIZE, 3).

    The cotangent points up in the picture, where v increases and row numbers decrease. The texture
    tiles without seams.
    """
    step = 2 * TILES / SIZE
    along_u = (np.roll(height, -1, axis=1) - np.roll(height, 1, axis=1)) / step
    along_v = (np.roll(height, 1, axis=0) - np.roll(height, -1, axis=0)) / step
    normal = np.stack([-along_u, -along_v, np.ones_like(height)], axis=-1)
    unit: Array = normal / np.linalg.norm(normal, axis=-1, keepdims=True)
    return unit


def save(values: Array, name: str) -> None:
    """Write values from 0 to 1 as an 8-bit PNG."""
    path = FOLDER / name
    Image.fromarray(np.floor(255 * values + 0.5).astype(np.uint8)).save(path, optimize=True)
    print(f"{path.name}: {SIZE} x {SIZE}, {path.stat().st_size} bytes")


def save_heights(values: Array, name: str) -> None:
    """Write values from 0 to 1 as a 16-bit greyscale PNG: 8 bits would turn slopes into steps."""
    path = FOLDER / name
    Image.fromarray(np.floor(65535 * values + 0.5).astype(np.uint16)).save(path, optimize=True)
    print(f"{path.name}: {SIZE} x {SIZE}, {path.stat().st_size} bytes")


def main() -> None:
    """Write all texture files."""
    FOLDER.mkdir(parents=True, exist_ok=True)
    tile = Tile()
    save(paint(tile), "tiles.png")
    height = relief(tile)
    save((normals(height) + 1) / 2, "tiles_normal.png")
    save_heights(height / height.max(), "tiles_height.png")
    STUDY_FOLDER.mkdir(parents=True, exist_ok=True)
    for name in STUDIED:
        shutil.copyfile(FOLDER / name, STUDY_FOLDER / name)
    print(f"white in tiles_height.png is {height.max():.6f} sides of a tile")


if __name__ == "__main__":
    main()
