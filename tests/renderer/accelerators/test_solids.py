"""The insides of closed meshes, and the shadows that they decide."""

from dataclasses import replace

import numpy as np
import pytest

from renderer.accelerators.solids import is_closed, solids_of
from renderer.integrator import intersect
from renderer.interaction import Rays
from renderer.math.arrays import Floats
from renderer.plan.building import compile_visibility
from renderer.visibility.polygon_scatter import ScatterPolygonShadows
from renderer.visibility.solids import SolidShadows
from renderer.workspace import Workspace
from tests import solids
from tests.documents import Json, bulb, camera, lamp, mesh, rectangle, sampled, scene, sun
from tests.pictures.parts import DOUBLE, SINGLE, image_of, plan_of

PLACES = pytest.mark.parametrize(
    "place", [[0.0, 0.0, 0.0], [148376.0, 1234.0, -223423.0]], ids=["near", "far"]
)


def ball(center: list[float], radius: float = 1.0, rounds: int = 3) -> Json:
    vertices, faces = solids.outward(center, radius, rounds)
    return mesh(vertices, faces)


def torus(around: int = 40, across: int = 16) -> Json:
    """Radius 1 to the middle of a tube of radius 0.4."""
    i, j = (part.reshape(-1) for part in np.meshgrid(np.arange(around), np.arange(across), indexing="ij"))
    a, b = 2 * np.pi * i / around, 2 * np.pi * j / across
    out = 1 + 0.4 * np.cos(b)
    vertices = np.stack((out * np.cos(a), 0.4 * np.sin(b), out * np.sin(a)), axis=1)
    index = np.arange(i.size).reshape(around, across)
    right, down = np.roll(index, -1, 0), np.roll(index, -1, 1)
    both = np.roll(right, -1, 1)
    faces = np.concatenate(
        [np.stack(part, -1).reshape(-1, 3) for part in ((index, down, right), (down, both, right))]
    )
    return mesh(vertices, faces)


def corners_of(*shapes: Json) -> Floats:
    """Corners (3, M) of all boxes that are found."""
    family = plan_of(scene(*shapes)).intersectors[0].family  # type: ignore[attr-defined]
    boxes = [solid.boxes for solid in solids_of(family)]
    sides = [np.stack((box.low, box.high)) for box in boxes]
    choice = np.array(list(np.ndindex(2, 2, 2)))
    return np.concatenate(
        [np.stack([side[choice[:, k], k] for k in range(3)]).reshape(3, -1) for side in sides], axis=1
    )


@PLACES
def test_boxes_are_inside_of_a_ball(place: list[float]) -> None:
    """Flat faces are nearer to the middle than their corners: by 1 % with 1,280 of them."""
    distances = np.linalg.norm(corners_of(ball(place)) - np.array(place)[:, None], axis=0)
    assert distances.max() < 0.99
    assert distances.max() > 0.8


def test_boxes_are_inside_of_a_ring_and_not_in_its_hole() -> None:
    x, y, z = corners_of(torus())
    assert (np.hypot(np.hypot(x, z) - 1, y) < 0.4).all()


def triangles_of(shape: Json) -> Floats:
    return np.array(shape["vertices"])[np.array(shape["triangles"])].transpose(1, 2, 0)


@PLACES
def test_a_mesh_is_closed_until_it_has_a_hole_or_a_face_turned_over(place: list[float]) -> None:
    whole = triangles_of(ball(place))
    assert is_closed(whole)
    assert not is_closed(whole[:, :, 1:])
    turned = whole.copy()
    turned[:, :, 5] = turned[[0, 2, 1], :, 5]
    assert not is_closed(turned)
    torn = whole.copy()
    torn[0, 0, 7] += 1e-9 * max(1.0, *map(abs, place))
    assert not is_closed(torn)


LIGHTS = {
    "rectangle": lamp([-1, 3, -1], [2, 0, 0], [0, 0, 2]),
    "point": bulb([0.3, 2.2, 0.1]),
    "directional": sun([0.1, -1, 0.2]),
}


@pytest.mark.slow
@pytest.mark.parametrize("quality", [SINGLE, DOUBLE], ids=["single", "double"])
@pytest.mark.parametrize("pattern", ["uniform", "sobol"])
@pytest.mark.parametrize("light", LIGHTS.values(), ids=LIGHTS)
def test_what_passes_a_box_is_hidden_by_some_triangle(light: Json, pattern: str, quality: object) -> None:
    floor = rectangle([-3, -1.5, -3], [0, 0, 6], [6, 0, 0])
    document = scene(floor, torus(), lights=[light], sampling=sampled(1, 16, light=pattern))
    plan = plan_of(document, quality)  # type: ignore[arg-type]
    rng = np.random.default_rng(8)
    targets = rng.uniform(-3, 3, (3, 4000)) * [[1], [0], [1]] + [[0], [-1.5], [0]]
    numbers = np.arange(4000)
    rays = Rays(np.array([[0.0], [-1.4], [0]]), targets - [[0], [-1.4], [0]], numbers, np.zeros_like(numbers))
    points = intersect(plan, rays, lights=False)
    (lighting,) = compile_visibility(plan)
    (stage,) = (shadow for shadow in lighting.shadows if isinstance(shadow, SolidShadows))
    family = lighting.shadows[-1].family  # type: ignore[attr-defined]
    every = ScatterPolygonShadows(family.occluders(), lighting.emitter, np.dtype(np.float64), False)
    found, true = (
        replace(lighting, shadows=(shadows,)).view(points, Workspace()).blocked for shadows in (stage, every)
    )
    assert found is not None
    assert true is not None
    assert not (found & ~true).any()
    assert found.sum() > true.sum() / 3


SCENES = {
    "a lamp above": [LIGHTS["rectangle"]],
    "the sun": [LIGHTS["directional"]],
    "a bulb in the ring's hole": [bulb([0, 0, 0])],
    "a bulb in the tube": [bulb([1, 0, 0])],
    "a lamp through the tube": [lamp([-2, 0, -0.1], [4, 0, 0], [0, 0, 0.2])],
}
VIEWS = {"from outside": [0.3, 2.5, 4.1], "from inside": [-1.0, 0.05, 0.02]}


@pytest.mark.parametrize("view", VIEWS.values(), ids=VIEWS)
@pytest.mark.parametrize("lights", SCENES.values(), ids=SCENES)
def test_no_pixel_depends_on_the_boxes(lights: list[Json], view: list[float]) -> None:
    floor = rectangle([-3, -1.5, -3], [0, 0, 6], [6, 0, 0])
    document = scene(
        floor,
        torus(),
        ball([1.2, 0.3, 0.2], 0.6),
        lights=lights,
        camera=camera(position=view, look_at=[0.1, -0.2, 0]),
        sampling=sampled(1, 16),
    )
    np.testing.assert_array_equal(image_of(document), image_of(document, culling=False))
