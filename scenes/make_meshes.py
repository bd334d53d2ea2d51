"""Make the mesh of the gallery: a sea shell, as a binary PLY file.

Run it with ``python -m scenes.make_meshes``. It takes no random numbers, so it writes the same shape every
time.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

FILE = Path(__file__).parent / "gallery" / "meshes" / "shell.ply"
ALONG = 360
"""Rings from the tip to the mouth."""
AROUND = 48
"""Vertices of a ring."""

TURNS = 6.0
GROWTH = 0.1
"""How fast the spiral widens: its radius grows by exp(GROWTH) a radian."""
TALL = 2.15
"""Height of the spire over the largest distance of the middle of the tube from the axis."""
TUBE = 0.62
"""Radius of the tube over the distance of its middle from the axis."""
RIBS = 11
"""Ribs a turn."""


def shell() -> tuple[Array, NDArray[np.int32]]:
    """Vertices (V, 3) and triangles (T, 3) of a shell that stands on its mouth, its axis upright.

    A tube along a logarithmic spiral, each ring a scaled copy of the one before (after Raup 1966), with ribs
    that fade towards the tip.
    """
    turn = np.linspace(-2 * np.pi * TURNS, 0, ALONG)[:, None]
    around = np.linspace(0, 2 * np.pi, AROUND, endpoint=False)[None, :]
    size = np.exp(GROWTH * turn)
    ribs = 1 + 0.07 * np.cos(RIBS * turn) ** 4 + 0.012 * np.cos(12 * around)
    radius = size * (1 + TUBE * ribs * np.cos(around))
    height = size * TUBE * ribs * 1.2 * np.sin(around) - TALL * size
    places = np.stack((radius * np.cos(turn), height, radius * np.sin(turn)), axis=-1).reshape(-1, 3)
    places[:, 1] -= places[:, 1].min()
    return places, _net()


def _net() -> NDArray[np.int32]:
    """Two triangles between each four neighbours, and both ends closed by a fan."""
    ring, place = np.meshgrid(np.arange(ALONG - 1), np.arange(AROUND), indexing="ij")
    a = (ring * AROUND + place).reshape(-1)
    b = (ring * AROUND + (place + 1) % AROUND).reshape(-1)
    sides = np.concatenate((np.stack((a, b, a + AROUND), 1), np.stack((b, b + AROUND, a + AROUND), 1)))
    fan = np.stack((np.zeros(AROUND - 2), np.arange(2, AROUND), np.arange(1, AROUND - 1)), 1).astype(int)
    return np.concatenate((sides, fan)).astype(np.int32)


def ply(vertices: Array, triangles: NDArray[np.int32]) -> bytes:
    """A mesh as binary little-endian PLY with float32 coordinates."""
    header = (
        "ply\nformat binary_little_endian 1.0\n"
        f"element vertex {len(vertices)}\nproperty float x\nproperty float y\nproperty float z\n"
        f"element face {len(triangles)}\nproperty list uchar int vertex_indices\nend_header\n"
    )
    faces = np.zeros(len(triangles), dtype=[("count", "u1"), ("vertices", "<i4", 3)])
    faces["count"], faces["vertices"] = 3, triangles
    return header.encode() + vertices.astype("<f4").tobytes() + faces.tobytes()


def main() -> None:
    """Write the file."""
    FILE.parent.mkdir(exist_ok=True)
    FILE.write_bytes(ply(*shell()))
    print(f"wrote {FILE}")


if __name__ == "__main__":
    main()
