"""Make the rays of the ready assignment and their scenes.

Run it with ``python -m scenes.make_assignment_rays``. Its random numbers have fixed seeds.
"""

from __future__ import annotations

import numpy as np

from scenes.make_assignment_parts import FOLDER, Json, ball, camera, ellipsoid, flat, scene, triangle
from scenes.make_hard_scenes import rectangle, text


def rays_round() -> Json:
    """Spheres and ellipsoids, some in front of others, one inside another."""
    shapes = [
        ball([0, 0, 0], 1.0, "red"),
        ball([2.5, 0.5, -1.0], 0.6, "green"),
        ellipsoid([-2.5, 0.2, 0.5], [[0.9, 0.3, 0], [-0.2, 0.6, 0], [0, 0, 1.4]], "blue"),
        ellipsoid([0.5, 2.4, 1.0], [[1.5, 0, 0], [0, 0.25, 0], [0, 0, 0.8]], "yellow"),
        ball([-2.5, 0.2, 0.5], 0.3, "violet"),
    ]
    return scene("rays_round", camera([0, 0, 9], [0, 0.6, 0], 40), shapes, materials=flat())


def rays_flat() -> Json:
    """Triangles and rectangles, narrow and wide, some in front of others."""
    shapes = [
        rectangle([-3, -2, 0], [2.5, 0.5, 0.5], [0.2, 2.4, -0.6], "red"),
        rectangle([0.2, -1.8, 1], [2.8, 0, -1], [0, 3.2, 0], "green"),
        triangle([-2.8, 0.2, 1.2], [0.4, 0.6, -0.8], [-1.0, 2.9, 0.4], "blue"),
        triangle([0.5, -0.5, -1.5], [3.4, -0.2, -0.5], [2.6, 2.8, -1.2], "yellow"),
        triangle([-1.5, -2.6, 1.5], [2.0, -2.2, 1.0], [0.1, -2.0, 1.4], "violet"),
    ]
    return scene("rays_flat", camera([0, 0, 9], [0.2, 0, 0], 44), shapes, materials=flat())


def rays_far() -> Json:
    """Shapes of both kinds, 50,000 to 200,000 units away and far smaller than that."""
    shapes = [
        ball([0, 0, -100000], 20.0, "red"),
        ball([90000, 20000, 30000], 400.0, "green"),
        ellipsoid([-50000, 8000, 0], [[60, 0, 0], [0, 15, 0], [0, 0, 30]], "blue"),
        triangle([30000, 40000, 50000], [30600, 40000, 49800], [30100, 40700, 50300], "yellow"),
        rectangle([-150000, -90000, 90000], [500, 0, 500], [0, 900, 0], "violet"),
    ]
    return scene("rays_far", camera([0, 0, 0], [0, 0, -100000], 1), shapes, materials=flat())


RAYS = {make.__name__: make for make in (rays_round, rays_flat, rays_far)}
"""Functions that build the scenes for rays, by name."""

SHOWN_NORMALS = ("rays_round", "rays_flat")
"""Scenes whose normals may be rendered instead."""

COUNT = 600
"""Number of rays for each scene."""


def rays(document: Json, seed: int) -> tuple[np.ndarray, np.ndarray]:
    """Rays at and past shapes, with directions of different lengths; a tenth starts inside a shape."""
    random = np.random.default_rng(seed)
    middles, sizes = zip(*(extent(shape) for shape in document["shapes"]), strict=True)
    chosen = random.integers(len(middles), size=COUNT)
    targets = np.array(middles)[chosen] + np.array(sizes)[chosen, None] * random.uniform(
        -0.8, 0.8, (COUNT, 3)
    )
    around = 6 if max(sizes) < 6 else 1000
    origins = random.normal(size=(COUNT, 3))
    origins *= around / np.linalg.norm(origins, axis=1, keepdims=True)
    inside = random.random(COUNT) < 0.1
    origins[inside] = np.array(middles)[random.integers(len(middles), size=int(inside.sum()))] + 0.01
    directions = targets - origins
    directions *= np.exp(random.uniform(-2, 2, (COUNT, 1))) / np.linalg.norm(
        directions, axis=1, keepdims=True
    )
    return origins, directions


def extent(shape: Json) -> tuple[np.ndarray, float]:
    """Centre and half extent of a shape."""
    if shape["type"] == "ellipsoid":
        size = shape.get("radius") or float(np.linalg.norm(shape["axes"], axis=1).max())
        return np.array(shape["center"], float), size
    if shape["type"] == "triangle":
        corners = np.array(shape["vertices"])
    else:
        corners = np.array(shape["corner"]) + np.array(
            [[0, 0, 0], *shape["edges"], np.sum(shape["edges"], axis=0)]
        )
    middle: np.ndarray = corners.mean(axis=0)
    return middle, float(np.linalg.norm(corners - middle, axis=1).max())


def main() -> None:
    """Write all scenes and rays."""
    for seed, (name, make) in enumerate(RAYS.items()):
        document = make()
        FOLDER.joinpath(f"{name}.json").write_text(text(document) + "\n", encoding="utf-8")
        origins, directions = rays(document, seed)
        np.savez_compressed(FOLDER / f"{name}.npz", origins=origins, directions=directions)


if __name__ == "__main__":
    main()
