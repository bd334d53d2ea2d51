"""CPU seconds of a ball as meshes of more and more triangles, and of the same ball as an ellipsoid."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, TypedDict

import numpy as np

import renderer
from benchmarks.machine import Spread, cpu_seconds, render_seconds, spread
from renderer.accelerators import trees
from renderer.shapes.meshes import Surface, triangles_of
from scenes.make_meshes import ply

if TYPE_CHECKING:
    from schemas.quality import Quality

COUNTS = (1_000, 10_000, 50_000, 100_000, 1_000_000)
"""Triangles, about."""


class MeshTiming(TypedDict):
    """One ball: its triangles (0 for the ellipsoid), CPU seconds of the picture and of building its tree."""

    triangles: int
    cpu_seconds: Spread
    tree_seconds: float


class _Memory(dict[str, bytes]):
    def read(self, name: str) -> bytes:
        return self[name]


def measure(runs: int) -> list[MeshTiming]:
    """Render the ellipsoid and every mesh `runs` times, after one run that warms caches up."""
    ellipsoid = {"type": "ellipsoid", "center": [0, 1, 0], "radius": 1, "material": "plain"}
    timings = [MeshTiming(triangles=0, cpu_seconds=_seconds(ellipsoid, {}, runs), tree_seconds=0.0)]
    for count in COUNTS:
        vertices, triangles = ball(count)
        shape = {"type": "mesh", "asset": "ball", "smooth": True, "material": "plain"}
        timings.append(
            MeshTiming(
                triangles=len(triangles),
                cpu_seconds=_seconds(shape, {"ball": ply(vertices, triangles)}, runs),
                tree_seconds=_tree_seconds(vertices, triangles),
            )
        )
    return timings


def ball(count: int) -> tuple[Any, Any]:
    """Vertices and triangles of a net of meridians and parallels, twice as many of the first."""
    rows = round((count / 4) ** 0.5)
    down, around = np.meshgrid(
        np.linspace(0, np.pi, rows + 1), np.arange(2 * rows) * np.pi / rows, indexing="ij"
    )
    places = (np.sin(down) * np.cos(around), 1 + np.cos(down), -np.sin(down) * np.sin(around))
    row, place = (
        part.reshape(-1) for part in np.meshgrid(np.arange(rows), np.arange(2 * rows), indexing="ij")
    )
    a, b = row * 2 * rows + place, row * 2 * rows + (place + 1) % (2 * rows)
    c, d = a + 2 * rows, b + 2 * rows
    triangles = np.concatenate((np.stack((a, c, b), 1), np.stack((b, c, d), 1)))
    return np.stack(places, axis=-1).reshape(-1, 3), triangles.astype(np.int32)


def _scene(shape: dict[str, Any]) -> dict[str, Any]:
    floor = {"type": "rectangle", "corner": [-3, 0, -3], "edges": [[0, 0, 6], [6, 0, 0]], "material": "plain"}
    lamp = {"type": "rectangle", "corner": [1, 4, 1], "edges": [[1, 0, 0], [0, 0, 1]], "color": [1, 1, 1]}
    return {
        "version": 1,
        "camera": {
            "position": [0, 2, 5],
            "look_at": [0, 0.8, 0],
            "vertical_fov": 40,
            "width": 512,
            "height": 512,
        },
        "materials": {"plain": {"type": "phong", "color": [0.8, 0.7, 0.6], "ambient": 0.1, "diffuse": 0.9}},
        "shapes": [floor, shape],
        "lights": [lamp],
        "sampling": {
            "antialiasing": {"pattern": "center", "samples": 1},
            "light": {"pattern": "stratified", "samples": 16},
        },
    }


def plan_of(
    shape: dict[str, Any], files: dict[str, bytes], quality: Quality | None = None
) -> renderer.RenderPlan:
    """Compile the scene with one shape on its floor; the files are its assets by name."""
    return renderer.compile_scene(renderer.load_scene(_scene(shape), assets=_Memory(files)), quality)


def _seconds(shape: dict[str, Any], files: dict[str, bytes], runs: int) -> Spread:
    plan = plan_of(shape, files)
    renderer.render(plan, workers=1)
    return spread([render_seconds(plan, workers=1) for _ in range(runs)])


def _tree_seconds(vertices: Any, triangles: Any) -> float:
    surface = Surface(vertices.T.copy(), triangles.T.astype(np.int64), None, mapped=False)
    family = triangles_of(0, surface.vertices, surface, smooth=False)
    begun = cpu_seconds()
    trees.build(family)
    return cpu_seconds() - begun
