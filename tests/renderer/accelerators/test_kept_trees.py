"""Trees are kept for many threads."""

import sys
import threading
import time
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor

import numpy as np
import pytest

from renderer.accelerators.trees import KEPT_TREES, Kept, tree_of
from renderer.shapes.triangles import Triangles, build
from schemas.shapes import Triangle
from tests.pictures.parts import Files

THREADS = 4 * KEPT_TREES
ROUNDS = 20

BUSY = 0.005
"""Seconds that every thread works on its value."""


@pytest.fixture
def restless() -> Iterator[None]:
    """Threads take turns as often as they can."""
    before = sys.getswitchinterval()
    sys.setswitchinterval(1e-6)
    yield
    sys.setswitchinterval(before)


def family(corners: np.ndarray) -> Triangles:
    """From triangles (K, 3, 3): triangle, vertex, coordinate."""
    shapes = [Triangle(type="triangle", vertices=rows, material="plain") for rows in corners.tolist()]
    return build(list(range(len(shapes))), shapes, Files())


def fan(number: int) -> Triangles:
    """40 triangles around a point, others for each number."""
    turns = np.linspace(0, 6, 41)
    rim = np.stack((np.cos(turns), np.sin(turns), np.full(41, float(number))), axis=1)
    return family(np.stack((np.zeros((40, 3)), rim[:-1], rim[1:]), axis=1))


@pytest.mark.usefixtures("restless")
def test_threads_get_the_trees_of_their_families() -> None:
    """All of them are done at the same time, and push each other's values out."""
    together = threading.Barrier(THREADS)

    def made(family: Triangles) -> bytes:
        together.wait()
        # The barrier lets threads go one by one; busy ones push each other aside anywhere.
        until = time.perf_counter() + BUSY
        while time.perf_counter() < until:
            pass
        return family.vertices.tobytes()

    families = [fan(number) for number in range(THREADS)]
    expected = [one.vertices.tobytes() for one in families]
    with ThreadPoolExecutor(THREADS) as pool:
        for _ in range(ROUNDS):
            assert list(pool.map(Kept(made), families)) == expected


def test_tree_of_the_same_vertices_is_used_again() -> None:
    assert tree_of(fan(1)) is tree_of(fan(1))
