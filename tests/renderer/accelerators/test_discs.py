"""Discs around the triangles of a node rise at least as high as they do, and not much higher."""

from fractions import Fraction
from typing import Any

import numpy as np
import pytest

from renderer.accelerators.trees import Tree, build
from renderer.math.arrays import unit
from renderer.shapes import triangles
from renderer.shapes.triangles import Triangles
from schemas.shapes import Triangle
from tests import solids
from tests.pictures.parts import Files

Floats = np.ndarray
PLACES = [[0.0, 0.0, 0.0], [148376.0, 1234.0, -223423.0]]


def family(corners: Floats) -> Triangles:
    """From triangles (K, 3, 3): triangle, vertex, coordinate."""
    shapes = [Triangle(type="triangle", vertices=rows, material="plain") for rows in corners.tolist()]
    return triangles.build(list(range(len(shapes))), shapes, Files())


def ball(place: Any) -> Floats:
    vertices, faces = solids.icosphere(place, 1.0, 3)
    return np.asarray(vertices)[np.asarray(faces)]


def soup(place: Any) -> Floats:
    rng = np.random.default_rng(1)
    return rng.uniform(-2, 2, (333, 1, 3)) + rng.normal(size=(333, 3, 3)) * 0.4 + place


def flat(place: Any) -> Floats:
    """Triangles in a plane, a third of them without area."""
    rng = np.random.default_rng(2)
    corners = rng.integers(0, 8, (90, 3, 3)) * [1.0, 0.0, 1.0]
    corners[::3] = corners[::3, :1]
    return corners + place


def held(tree: Tree, depth: int) -> list[list[int]]:
    """Triangles below each node that has a disc: leaves at depth 0, nodes above them at 1."""
    width = tree.items.shape[1] * (tree.levels[-1].children if depth else 1)
    return [[item for item in row if item >= 0] for row in tree.items.reshape(-1, width).tolist()]


@pytest.mark.parametrize("place", PLACES, ids=["at the origin", "far away"])
@pytest.mark.parametrize("make", [ball, soup, flat], ids=["ball", "soup", "flat"])
@pytest.mark.parametrize("depth", [0, 1], ids=["leaves", "nodes above"])
def test_no_vertex_is_higher_than_the_disc_of_its_node(make: Any, place: list[float], depth: int) -> None:
    corners = make(place)
    tree = build(family(corners))
    rng = np.random.default_rng(3)
    axes = tree.discs[depth].values[3:6]
    # Normals along an axis and across it are those whose square roots cancel or add most.
    across = unit(np.cross(axes.T, [0.3, 0.5, 0.7]).T + 1e-300)
    for normals in (unit(rng.normal(size=axes.shape)), axes, -axes, across):
        heights = tree.discs[depth].heights(normals, np.arange(axes.shape[1]))
        for number, items in enumerate(held(tree, depth)):
            normal = [Fraction(part) for part in normals[:, number].tolist()]
            for vertex in corners[items].reshape(-1, 3).tolist():
                height = sum(a * Fraction(b) for a, b in zip(normal, vertex, strict=True))
                assert heights[number] >= height
