"""Closed solids and rooms whose faces share corners and edges bit for bit."""

import itertools

import numpy as np

from tests.documents import Json, triangle

Floats = np.ndarray


def turned_box(center: Floats, axes: Floats, size: float) -> list[Json]:
    """Six rectangles by their centres, whose corners agree but for rounding; rows of `axes` are unit."""
    return [
        {
            "type": "rectangle",
            "center": (center + side * size / 2 * axes[i]).tolist(),
            "normal": (side * axes[i]).tolist(),
            "tangent": axes[(i + 1) % 3].tolist(),
            "size": [size, size],
            "material": "plain",
        }
        for i, side in itertools.product(range(3), (-1, 1))
    ]


def turned_box_edges(center: Floats, axes: Floats, size: float, shares: Floats) -> Floats:
    """Places on the twelve edges of the same box, at `shares` from -1 to 1 of half an edge."""
    half = axes * size / 2
    return np.concatenate(
        [
            center + np.outer(shares, half[i]) + a * half[(i + 1) % 3] + b * half[(i + 2) % 3]
            for i, a, b in itertools.product(range(3), (-1, 1), (-1, 1))
        ]
    )


def icosphere(center: list[float], radius: float, rounds: int) -> tuple[Floats, Floats]:
    """Vertices (V, 3) near a sphere and triangles (T, 3) of a closed mesh."""
    g = (1 + 5**0.5) / 2
    vertices = [
        np.array(v) for a, b in itertools.product((-1, 1), (-g, g)) for v in ((0, a, b), (a, b, 0), (b, 0, a))
    ]
    near = min(float(np.linalg.norm(a - b)) for a, b in itertools.combinations(vertices, 2))
    faces = [
        face
        for face in itertools.combinations(range(12), 3)
        if all(
            np.linalg.norm(vertices[i] - vertices[j]) < 1.01 * near
            for i, j in itertools.combinations(face, 2)
        )
    ]
    for _ in range(rounds):
        faces = _divided(vertices, faces)
    places = np.array([v / np.linalg.norm(v) for v in vertices]) * radius + center
    return places, np.array(faces)


def outward(center: list[float], radius: float, rounds: int) -> tuple[Floats, Floats]:
    """The same mesh with all triangles counter-clockwise seen from outside."""
    vertices, faces = icosphere(center, radius, rounds)
    a, b, c = (vertices[column] for column in faces.T)
    inward = ((np.cross(b - a, c - a)) * (a - center)).sum(axis=1) < 0
    return vertices, np.where(inward[:, None], faces[:, ::-1], faces)


def _divided(vertices: list[Floats], faces: list[tuple[int, int, int]]) -> list[tuple[int, int, int]]:
    middles: dict[tuple[int, int], int] = {}

    def middle(i: int, j: int) -> int:
        key = (min(i, j), max(i, j))
        if key not in middles:
            vertices.append(
                (vertices[i] / np.linalg.norm(vertices[i]) + vertices[j] / np.linalg.norm(vertices[j])) / 2
            )
            middles[key] = len(vertices) - 1
        return middles[key]

    smaller = []
    for a, b, c in faces:
        ab, bc, ca = middle(a, b), middle(b, c), middle(c, a)
        smaller += [(a, ab, ca), (ab, b, bc), (ca, bc, c), (ab, bc, ca)]
    return smaller


def triangles_of(vertices: Floats, faces: Floats) -> list[Json]:
    """One triangle of the scene language a face."""
    return [triangle(*(vertices[i].tolist() for i in face)) for face in faces]


def edge_places(vertices: Floats, faces: Floats, shares: list[float]) -> Floats:
    """Places on all edges of a mesh, as well as doubles can say."""
    pairs = sorted(
        {tuple(sorted(pair)) for face in faces.tolist() for pair in itertools.combinations(face, 2)}
    )
    return np.array([vertices[i] + s * (vertices[j] - vertices[i]) for i, j in pairs for s in shares])
