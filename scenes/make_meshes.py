"""Make the meshes of the gallery and of the study: a seashell in two resolutions, as binary PLY files.

Run it with ``python -m scenes.make_meshes``. It uses no random numbers, so it writes the same shapes every
time.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

FILE = Path(__file__).parent / "gallery" / "meshes" / "shell.ply"
ALONG = 360
"""Rings from the tip to the opening."""
AROUND = 48
"""Vertices per ring."""
FINE_FILE = Path(__file__).parent / "study" / "meshes" / "shell.ply"
FINE_ALONG, FINE_AROUND = 440, 57
"""Rings and vertices of the shell for the study, which has about 50,000 triangles."""

TURNS = 6.0
GROWTH = 0.1
"""Growth of the spiral: its radius grows by exp(GROWTH) per radian."""
TALL = 2.15
"""Height of the spire, relative to the largest distance of the tube's centre from the axis."""
TUBE = 0.62
"""Radius of the tube, relative to the distance of its centre from the axis."""
RIBS = 11
"""Ribs per turn."""


def shell(along: int = ALONG, around: int = AROUND) -> tuple[Array, NDArray[np.int32]]:
    """Vertices (V, 3) and triangles (T, 3) of a shell that stands on its opening, with a vertical axis.

    A tube along a logarithmic spiral, each ring a scaled copy of the previous one (after Raup 1966), with
    ribs that fade towards the tip.
    """
    turn = np.linspace(-2 * np.pi * TURNS, 0, along)[:, None]
    angle = np.linspace(0, 2 * np.pi, around, endpoint=False)[None, :]
    size = np.exp(GROWTH * turn)
    ribs = 1 + 0.07 * np.cos(RIBS * turn) ** 4 + 0.012 * np.cos(12 * angle)
    radius = size * (1 + TUBE * ribs * np.cos(angle))
    height = size * TUBE * ribs * 1.2 * np.sin(angle) - TALL * size
    places = np.stack((radius * np.cos(turn), height, radius * np.sin(turn)), axis=-1).reshape(-1, 3)
    places[:, 1] -= places[:, 1].min()
    return places, _net(along, around)


def _net(along: int, around: int) -> NDArray[np.int32]:
    """Two triangles for each four neighbouring vertices, and a fan to close each end."""
    ring, place = np.meshgrid(np.arange(along - 1), np.arange(around), indexing="ij")
    a = (ring * around + place).reshape(-1)
    b = (ring * around + (place + 1) % around).reshape(-1)
    sides = np.concatenate((np.stack((a, b, a + around), 1), np.stack((b, b + around, a + around), 1)))
    fan = np.stack((np.zeros(around - 2), np.arange(2, around), np.arange(1, around - 1)), 1).astype(int)
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
    """Write all meshes."""
    for path, mesh in ((FILE, shell()), (FINE_FILE, shell(FINE_ALONG, FINE_AROUND))):
        path.parent.mkdir(exist_ok=True)
        path.write_bytes(ply(*mesh))
        print(f"wrote {path}: {len(mesh[1])} triangles")


if __name__ == "__main__":
    main()
