"""Rays at shared edges and vertices lose nothing: neither hits nor shadow."""

import numpy as np
import pytest

from renderer.accelerators.trees import FEW
from schemas.reading import read_scene
from tests import solids
from tests.documents import bulb, lamp, mesh, rectangle, scene, sun
from tests.numerics import oracle
from tests.numerics.tracing import EPS, towards, traced
from tests.pictures.parts import DOUBLE, SINGLE

FAR = [148376.0, 1234.0, -223423.0]
PLACES = [[0.0, 0.0, 0.0], FAR]
PLACE_IDS = ["at the origin", "far away"]
SHARES = [0.0, 0.25, 1 / 3, 0.5, 0.7]
BOTH = pytest.mark.parametrize("quality", [SINGLE, DOUBLE], ids=["single", "double"])
EVERYWHERE = pytest.mark.parametrize("place", PLACES, ids=PLACE_IDS)


@EVERYWHERE
@pytest.mark.parametrize("points", [1, 16])
def test_neither_ray_nor_light_leaves_a_closed_mesh_in_a_tree(place: list[float], points: int) -> None:
    vertices, faces = solids.icosphere(place, 1.0, 3)
    assert len(faces) > FEW
    targets = solids.edge_places(vertices, faces, SHARES)
    outside = np.add(place, [0.3, 1.9, 0.4]).tolist()
    corner = np.add(place, [-0.5, -2.5, -0.5]).tolist()
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
        around = center + np.array([[-0.9, 0.7, -0.8], [0.3, 0, 0], [0, 0, 2.0]]) @ axes * size
        edges = (around[1:] - center).tolist()
        hits = traced(
            solids.turned_box(center, axes, size),
            *towards(start.tolist(), targets),
            lights=[bulb(outside.tolist()), lamp(around[0].tolist(), *edges, visible=False)],
            points=9,
            pattern=("uniform", "sobol")[turn % 2],
        )
        assert (hits.shape >= 0).all()
        assert (hits.visibility == 0).all()


def test_the_border_of_a_rectangle_is_no_wider_than_rounding() -> None:
    """16 eps of the largest coordinate, over the sine of the angle between ray and edge."""
    rng = np.random.default_rng(10)
    beside = 0
    for scale in (0.0, 1.0, 1e6):
        for _ in range(25):
            corner, first, second = rng.normal(size=3) * scale + rng.normal(size=3), *rng.normal(size=(2, 3))
            shape = rectangle(corner.tolist(), first.tolist(), second.tolist())
            true_shape = read_scene(scene(shape))[0].shapes[0]
            far, along = rng.integers(0, 2, 20), rng.uniform(0, 1, 20)
            hair = (2 * far - 1) * EPS * np.abs(corner).max() * rng.uniform(0, 60, 20)
            targets = corner + np.outer(far + hair, first) + np.outer(along, second)
            origins = corner + rng.normal(size=(20, 3)) * 3
            hits = traced([shape], origins, targets - origins)
            for i in np.flatnonzero(hits.shape == 0):
                direction = targets[i] - origins[i]
                true = oracle.answer(true_shape, origins[i], direction)
                if not true.hit:
                    beside += 1
                    assert true.margin * _least_sine(direction, (first, second)) <= 16 * EPS
    assert beside > 10


def _least_sine(direction: np.ndarray, edges: tuple[np.ndarray, np.ndarray]) -> float:
    along = direction / np.linalg.norm(direction)
    return float(min(np.linalg.norm(np.cross(along, edge / np.linalg.norm(edge))) for edge in edges))


@BOTH
@EVERYWHERE
def test_no_light_leaves_a_closed_mesh(place: list[float], quality: object) -> None:
    """The shadows of edges and vertices on a floor, of a bulb inside."""
    vertices, faces = solids.icosphere(place, 1.0, 1)
    x, y, z = place
    floor = rectangle([x - 40, y - 2, z - 40], [0.0, 0.0, 80.0], [80.0, 0.0, 0.0])
    inside = [x + 0.125, y + 0.25, z - 0.0625]
    places = solids.edge_places(vertices, faces, SHARES)
    falling = places - inside
    below = falling[:, 1] < -0.2
    shadows = inside + falling[below] * ((-2.25 / falling[below, 1])[:, None])
    above = shadows + np.array([0.0, 9, 0])
    away = np.array([-60.0, 1.0, 0.0]) + place
    for starts in (above, np.broadcast_to(away, shadows.shape)):
        hits = traced(
            [*solids.triangles_of(vertices, faces), floor],
            starts,
            shadows - starts,
            lights=[bulb(inside)],
            quality=quality,  # type: ignore[arg-type]
        )
        outside = hits.shape == len(faces)
        assert outside.sum() > 50
        assert (hits.visibility[outside] == 0).all()


@BOTH
@EVERYWHERE
def test_a_convex_solid_shades_its_faces_by_their_normals_alone(place: list[float], quality: object) -> None:
    vertices, faces = solids.icosphere(place, 1.0, 1)
    mesh = solids.triangles_of(vertices, faces)
    light = np.array(place) + np.array([3.0, 2.0, 1.0])
    rng = np.random.default_rng(8)
    targets = solids.edge_places(vertices, faces, SHARES) - place
    targets = np.concatenate((targets, targets + rng.normal(size=targets.shape) * 1e-3)) * 0.97 + place
    starts = place + (targets - place) * 5 + rng.normal(size=targets.shape) * 0.2
    hits = traced(mesh, starts, targets - starts, lights=[bulb(light.tolist())], quality=quality)  # type: ignore[arg-type]
    assert (hits.shape >= 0).all()
    cosine = (hits.normal * (light - hits.position)).sum(axis=1)
    lit = cosine > 1e-6
    assert lit.any()
    assert (hits.visibility[lit] == 1).all()
    assert (hits.visibility[cosine < -1e-6] == 0).all()
