"""Rays at shared edges and vertices lose nothing: neither hits nor shadow."""

import numpy as np
import pytest

from tests import solids
from tests.documents import bulb, lamp, mesh, rectangle, sun
from tests.numerics import oracle
from tests.numerics.tracing import EPS, read_shape, towards, traced

SHARES = [0.0, 0.25, 1 / 3, 0.5, 0.7]
EVERYWHERE = pytest.mark.parametrize(
    "place", [[0.0, 0.0, 0.0], [148376.0, 1234.0, -223423.0]], ids=["at the origin", "far away"]
)


@EVERYWHERE
@pytest.mark.parametrize("points", [1, 16])
def test_neither_ray_nor_light_leaves_a_closed_mesh_in_a_tree(place: list[float], points: int) -> None:
    vertices, faces = solids.icosphere(place, 1.0, 3)
    targets = solids.edge_places(vertices, faces, SHARES)
    outside, corner = np.add(place, [0.3, 1.9, 0.4]), np.add(place, [-0.5, -2.5, -0.5])
    start = np.random.default_rng(7).uniform(-0.3, 0.3, 3) + place
    hits = traced(
        [mesh(vertices, faces)],
        *towards(start.tolist(), targets),
        lights=[bulb(outside), lamp(corner, [1, 0, 0], [0, 0, 1], visible=False), sun([1, 2, 3])],
        points=points,
    )
    assert (hits.shape == 0).all()
    assert (hits.visibility == 0).all()


@EVERYWHERE
def test_neither_ray_nor_light_passes_the_edges_of_a_turned_box(place: list[float]) -> None:
    """Rectangles by centre, normal and size have corners that agree but for rounding; no gap comes of it."""
    rng = np.random.default_rng(9)
    for turn in range(30):
        axes = np.linalg.qr(rng.normal(size=(3, 3)))[0].T if turn else np.eye(3)
        center, size = np.array(place) + rng.normal(size=3), rng.uniform(0.5, 3)
        targets = solids.turned_box_edges(center, axes, size, np.append(rng.uniform(-1, 1, 30), [-1, 1]))
        start = center + rng.uniform(-0.4, 0.4, 3) @ axes * size
        outside = center + np.array([0.9, 0.7, 0.8]) @ axes * size
        corner, *ends = center + np.array([[-0.9, 0.7, -0.8], [0.3, 0, 0], [0, 0, 2.0]]) @ axes * size
        hits = traced(
            solids.turned_box(center, axes, size),
            *towards(start.tolist(), targets),
            lights=[bulb(outside), lamp(corner, *(end - center for end in ends), visible=False)],
            points=9,
            pattern=("uniform", "sobol")[turn % 2],
        )
        assert (hits.shape >= 0).all()
        assert (hits.visibility == 0).all()


def test_border_of_a_rectangle_is_no_wider_than_rounding() -> None:
    """16 eps of the largest coordinate, over the sine of the angle between ray and edge."""
    rng = np.random.default_rng(10)
    beside = 0
    for scale in (0.0, 1.0, 1e6):
        for _ in range(12):
            corner, *edges = rng.normal(size=3) * scale + rng.normal(size=3), *rng.normal(size=(2, 3))
            shape = rectangle(corner, *edges)
            exact = read_shape(shape)
            far, along = rng.integers(0, 2, 20), rng.uniform(0, 1, 20)
            hair = (2 * far - 1) * EPS * np.abs(corner).max() * rng.uniform(0, 60, 20)
            targets = corner + np.outer(far + hair, edges[0]) + np.outer(along, edges[1])
            origins = corner + rng.normal(size=(20, 3)) * 3
            ways = targets - origins
            for i in np.flatnonzero(traced([shape], origins, ways).shape == 0):
                true = oracle.answer(exact, origins[i], ways[i])
                if not true.hit:
                    beside += 1
                    sines = np.linalg.norm(np.cross(ways[i], edges), axis=1) / np.linalg.norm(edges, axis=1)
                    assert true.margin * sines.min() / np.linalg.norm(ways[i]) <= 16 * EPS
    assert beside > 10
