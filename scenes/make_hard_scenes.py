"""Make the hard scenes with generated geometry, and the texture that some of them share.

Run it with ``python -m scenes.make_hard_scenes``. It uses no random numbers, so it writes the same
files every time.
"""

from __future__ import annotations

import itertools
import json
import math
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from PIL import Image

if TYPE_CHECKING:
    from collections.abc import Sequence

Json = dict[str, Any]
Place = tuple[float, float, float]

FOLDER = Path(__file__).parent / "hard"
LINE = 110
"""Longest line of a scene file."""
DIGITS = 7
"""Decimals of a coordinate: enough for rendering, and the same on every machine."""
FINE = 12
"""Decimals for vertices that are only 1e-8 apart."""


def main() -> None:
    """Write all scenes and the texture."""
    FOLDER.joinpath("textures").mkdir(parents=True, exist_ok=True)
    for name, make in SCENES.items():
        FOLDER.joinpath(f"{name}.json").write_text(text(make()) + "\n", encoding="utf-8")
    Image.fromarray(waves()).save(FOLDER / "textures" / "waves.png", optimize=True)


def coarse_mesh() -> Json:
    """A ball of 80 triangles, once flat and once with smooth normals, under a low lamp."""
    vertices, triangles = ball(rounds=1)
    mesh = {"type": "mesh", "vertices": vertices, "triangles": triangles, "material": "ball"}
    return {
        "version": 1,
        "name": "coarse_mesh",
        "camera": camera([0, 1.9, 7], [0, 0.95, 0], 34),
        "background": [0.42, 0.6, 0.86],
        "ambient": [1, 1, 1],
        "materials": {
            "ball": phong([0.8, 0.45, 0.25], ambient=0.2),
            "floor": phong([0.6, 0.6, 0.58], ambient=0.2),
        },
        "shapes": [
            rectangle([-8, 0, -8], [0, 0, 16], [16, 0, 0], "floor"),
            {"name": "flat", **mesh, "translate": [-1.5, 1, 0.3]},
            {"name": "smooth", **mesh, "smooth": True, "translate": [1.1, 1, 0.3]},
        ],
        "lights": [{"type": "directional", "direction": [0.8, -0.4, -0.45], "color": [0.85, 0.82, 0.75]}],
        "sampling": sampling("rotated", 16),
    }


def slivers() -> Json:
    """A disc cut into a fan of ever thinner triangles: down to less than 1e-7 of their length."""
    # Alternate narrow and wide triangles, so that neighbours differ as much as possible.
    widths = [w for k in range(1, 22) for w in (10 ** (-k / 3), 0.3 + 0.1 * (k % 3))]
    turns = np.cumsum(widths) * 2 * math.pi / sum(widths)
    rim = [[round(1.3 * math.cos(a), FINE), round(1.3 * math.sin(a), FINE), 0.0] for a in turns.tolist()]
    triangles = [[0, i, i % len(rim) + 1] for i in range(1, len(rim) + 1)]
    return {
        "version": 1,
        "name": "slivers",
        "camera": camera([0.4, 0.3, 6], [0.1, -0.1, 0], 32),
        "background": [1, 1, 1],
        "ambient": [1, 1, 1],
        "materials": {
            "fan": phong([0.3, 0.35, 0.5], ambient=0.3),
            "wall": phong([0.8, 0.78, 0.7], ambient=0.3),
        },
        "shapes": [
            {
                "name": "fan",
                "type": "mesh",
                "vertices": [[0.0, 0.0, 0.0], *rim],
                "triangles": triangles,
                "material": "fan",
            },
            rectangle([-4, -2.4, -0.8], [8, 0, 0], [0, 4.8, 0], "wall"),
        ],
        "lights": [{"type": "point", "position": [-1, 2.5, 6], "color": [0.7, 0.7, 0.7]}],
        "sampling": sampling("rotated", 16),
    }


def skew_blocks() -> Json:
    """Tumbling blocks: a flat pattern with three parallelograms per block and no right angle."""
    # Sixteenths, so that corners of neighbours agree to the last bit; angles are within 0.3 of 60 degrees.
    up, right, left = (0.0, 0.5), (7 / 16, -0.25), (-7 / 16, -0.25)
    shapes = []
    for row, column in itertools.product(range(-3, 4), range(-4, 5)):
        middle = (7 / 8 * (column + row % 2 / 2), 0.75 * row)
        for first, second, material in ((right, up, "light"), (up, left, "dark"), (left, right, "middle")):
            shapes.append(rectangle([*middle, 0], [*first, 0], [*second, 0], material))
    return {
        "version": 1,
        "name": "skew_blocks",
        "camera": camera([0.2, 0.3, 5], [0, 0, 0], 34),
        "background": [1, 1, 1],
        "ambient": [1, 1, 1],
        "materials": {
            "light": phong([0.85, 0.7, 0.4], ambient=0.6, diffuse=0.4),
            "middle": phong([0.6, 0.35, 0.2], ambient=0.6, diffuse=0.4),
            "dark": phong([0.25, 0.15, 0.15], ambient=0.6, diffuse=0.4),
        },
        "shapes": shapes,
        "lights": [{"type": "point", "position": [-2, 3, 4], "color": [0.9, 0.9, 0.9]}],
        "sampling": sampling("rotated", 16),
    }


def displaced_solids() -> Json:
    """A cube and a sphere, both closed, both displaced by the same waves."""
    corners = [list(map(float, corner)) for corner in itertools.product((-1, 1), repeat=3)]
    faces = [(0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3)]
    cube = {
        "name": "cube",
        "type": "mesh",
        "vertices": corners,
        "triangles": [list(t) for a, b, c, d in faces for t in ((a, b, c), (a, c, d))],
        "uvs": [[x / 4 + y / 8, z / 4 + y / 8] for x, y, z in corners],
        "scale": 0.62,
        "rotate": {"axis": [0.2, 1, 0.1], "degrees": 33},
        "translate": [-1.15, 0.95, 0],
        "material": "waves",
    }
    return {
        "version": 1,
        "name": "displaced_solids",
        "camera": camera([0, 2.4, 6], [0, 0.85, 0], 32),
        "background": [1, 0.95, 0.4],
        "ambient": [1, 1, 1],
        "textures": {
            "waves": {"type": "image", "asset": "textures/waves.png", "encoding": "linear", "wrap": "repeat"}
        },
        "materials": {
            "waves": phong([0.25, 0.4, 0.55], displacement_map="waves", displacement_height=0.3),
            "floor": phong([0.65, 0.6, 0.5], ambient=0.2),
        },
        "shapes": [
            cube,
            {
                "name": "ball",
                "type": "ellipsoid",
                "center": [1.2, 0.95, 0],
                "radius": 0.8,
                "material": "waves",
            },
            rectangle([-8, 0, -8], [0, 0, 16], [16, 0, 0], "floor"),
        ],
        "lights": [{"type": "point", "position": [-4, 6, 4], "color": [0.85, 0.85, 0.8]}],
        "sampling": sampling("rotated", 4),
    }


def rotated_grid() -> Json:
    """A star of narrow spokes, so that edges have all angles."""
    spokes = []
    for degrees in range(2, 360, 8):
        x, y = math.cos(math.radians(degrees)), math.sin(math.radians(degrees))
        spokes.append(
            rectangle([0.45 * x, 0.45 * y, 0], [1.45 * x, 1.45 * y, 0], [-0.035 * y, 0.035 * x, 0], "spoke")
        )
    return {
        "version": 1,
        "name": "rotated_grid",
        "camera": camera([0, 0, 10], [0, 0, 0], 24, 200, 200),
        "ambient": [1, 1, 1],
        "materials": {
            "spoke": phong([0.95, 0.95, 0.95], ambient=0.2, diffuse=0.8),
            "plate": phong([0.35, 0.35, 0.35], ambient=0.2, diffuse=0.8),
        },
        "shapes": [*spokes, rectangle([-5, -5, -0.05], [10, 0, 0], [0, 10, 0], "plate")],
        "lights": [{"type": "directional", "direction": [0, 0, -1], "color": [1, 1, 1]}],
        "sampling": sampling("rotated", 16),
    }


SCENES = {make.__name__: make for make in (coarse_mesh, slivers, skew_blocks, displaced_solids, rotated_grid)}


def ball(rounds: int) -> tuple[list[list[float]], list[list[int]]]:
    """Vertices on the unit sphere and triangles of an icosahedron, each split into four `rounds` times."""
    golden = (1 + math.sqrt(5)) / 2
    signs = list(itertools.product((-1, 1), (-golden, golden)))
    vertices = [unit(v) for a, b in signs for v in ((0, a, b), (a, b, 0), (b, 0, a))]
    triangles = [
        outward(t, vertices) for t in itertools.combinations(range(12), 3) if neighbours(t, vertices)
    ]
    for _ in range(rounds):
        triangles = quartered(vertices, triangles)
    return [[round(x, DIGITS) for x in v] for v in vertices], [list(t) for t in triangles]


def unit(v: Sequence[float]) -> Place:
    """A point on the unit sphere."""
    length = math.hypot(*v)
    return v[0] / length, v[1] / length, v[2] / length


def neighbours(triangle: Sequence[int], vertices: Sequence[Place]) -> bool:
    """Whether three vertices of an icosahedron form a face: all pairs are 1.05 radii apart."""
    # Edges are 1.0515 long; the next larger distance is 1.7.
    return all(math.dist(vertices[i], vertices[j]) < 1.3 for i, j in itertools.combinations(triangle, 2))


def outward(triangle: tuple[int, int, int], vertices: Sequence[Place]) -> tuple[int, int, int]:
    """Orient a triangle counter-clockwise as seen from outside."""
    a, b, c = triangle
    return triangle if np.linalg.det([vertices[i] for i in triangle]) > 0 else (a, c, b)


def quartered(vertices: list[Place], triangles: Sequence[Sequence[int]]) -> list[tuple[int, int, int]]:
    """Split each triangle into four; the new vertices, one per edge, are appended."""
    middles: dict[frozenset[int], int] = {}

    def middle(i: int, j: int) -> int:
        edge = frozenset((i, j))
        if edge not in middles:
            middles[edge] = len(vertices)
            vertices.append(unit([p + q for p, q in zip(vertices[i], vertices[j], strict=True)]))
        return middles[edge]

    smaller = []
    for a, b, c in triangles:
        ab, bc, ca = middle(a, b), middle(b, c), middle(c, a)
        smaller += [(a, ab, ca), (ab, b, bc), (ca, bc, c), (ab, bc, ca)]
    return smaller


def waves() -> np.ndarray:
    """Colour codes (32, 64, 3) of waves that continue across the left and right borders."""
    v, u = np.meshgrid((np.arange(32) + 0.5) / 32, (np.arange(64) + 0.5) / 64, indexing="ij")
    along, across = 2 * math.pi * u, 2 * math.pi * v
    shape = 0.3 * np.sin(3 * along) * np.sin(2 * across) + 0.2 * np.cos(5 * along + across)
    height = 0.5 + np.sin(across / 2) * shape
    colors = np.stack((height, 0.25 + 0.5 * height, 1 - height), axis=-1)
    codes: np.ndarray = np.round(255 * colors).astype(np.uint8)
    return codes


def camera(
    position: list[float], look_at: list[float], fov: float, width: int = 240, height: int = 160
) -> Json:
    """A small camera."""
    place = {"position": position, "look_at": look_at}
    return {**place, "vertical_fov": fov, "width": width, "height": height}


def phong(color: list[float], **changes: Any) -> Json:
    """A matte material."""
    return {"type": "phong", "color": color, "diffuse": 0.85, **changes}


def rectangle(corner: list[float], first: list[float], second: list[float], material: str) -> Json:
    """A parallelogram with a corner and two edges."""
    place, *edges = ([round(x, DIGITS) for x in v] for v in (corner, first, second))
    return {"type": "rectangle", "corner": place, "edges": edges, "material": material}


def sampling(pattern: str, samples: int) -> Json:
    """Camera sampling; the lights of these scenes are points."""
    return {"antialiasing": {"pattern": pattern, "samples": samples}}


def text(value: Any, depth: int = 0) -> str:
    """Readable JSON with lines of up to LINE columns."""
    whole = json.dumps(value)
    if len(whole) + 2 * depth < LINE or not isinstance(value, dict | list):
        return whole
    if isinstance(value, dict):
        parts = [f"{json.dumps(name)}: {text(part, depth + 1)}" for name, part in value.items()]
    else:
        parts = [text(part, depth + 1) for part in value]
    opening, closing = "{}" if isinstance(value, dict) else "[]"
    indent = "  " * (depth + 1)
    return f"{opening}\n{indent}" + f",\n{indent}".join(parts) + f"\n{'  ' * depth}{closing}"


if __name__ == "__main__":
    main()
