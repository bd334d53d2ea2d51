"""Trees are kept for the plans that a server compiles in many threads at once."""

import sys
import threading
import time
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor

import numpy as np
import pytest

from renderer.accelerators.trees import KEPT, Kept, tree_of
from renderer.assets import AssetSource
from renderer.shapes import meshes
from renderer.shapes.triangles import Triangles
from schemas.shapes import Mesh
from tests.images.parts import Files

THREADS = 4 * KEPT
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


def family(number: int) -> Triangles:
    """A fan of 40 triangles, another one for each number."""
    turns = np.linspace(0, 6, 41)
    rim = np.stack((np.cos(turns), np.sin(turns), np.full(41, float(number))), axis=1)
    vertices = [[0.0, 0.0, 0.0], *rim.tolist()]
    triangles = [[0, i, i + 1] for i in range(1, 41)]
    shape = Mesh.model_validate(
        {"type": "mesh", "vertices": vertices, "triangles": triangles, "material": "plain"}
    )
    source: AssetSource = Files()
    return meshes.build([0], [shape], source)


@pytest.mark.usefixtures("restless")
def test_each_of_many_threads_gets_what_was_made_of_its_family() -> None:
    """All of them are done at the same moment, and push each other's values out."""
    together = threading.Barrier(THREADS)

    def made(family: Triangles) -> bytes:
        together.wait()
        # The barrier lets threads go one by one; busy ones push each other aside anywhere.
        until = time.perf_counter() + BUSY
        while time.perf_counter() < until:
            pass
        return family.vertices.tobytes()

    families = [family(number) for number in range(THREADS)]
    expected = [one.vertices.tobytes() for one in families]
    with ThreadPoolExecutor(THREADS) as pool:
        for _ in range(ROUNDS):
            assert list(pool.map(Kept(made), families)) == expected


def test_the_tree_of_the_same_vertices_is_used_again() -> None:
    assert tree_of(family(1)) is tree_of(family(1))
