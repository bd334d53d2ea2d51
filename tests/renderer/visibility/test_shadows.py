"""Shadows of area lights: shares of a lamp that are exact on analytic grounds."""

import numpy as np
import pytest

import renderer
from tests.documents import camera, lamp, mesh, phong, rectangle, sampled, scene, triangle
from tests.pictures.paired_scenes import cut
from tests.pictures.parts import DOUBLE, image_of, plan_of

FLOOR = rectangle([-9, 0, -9], [0, 0, 18], [18, 0, 0])
LAMP = lamp([-1, 5, -2], [4, 0, 0], [0, 0, 4])
WALLS = {
    "rectangle": rectangle([0, -9, -90], [0, 0, 180], [0, 90, 0]),
    "triangle": triangle([0, -900, -900], [0, 900, 0], [0, -900, 900]),
}


@pytest.mark.parametrize("pattern", ["uniform", "stratified", "sobol"])
@pytest.mark.parametrize("wall", WALLS)
def test_area_light_is_cut_to_its_exact_share(wall: str, pattern: str) -> None:
    """The wall cuts a quarter of the lamp off, along cells: in each there is one of 16 points."""
    plan = plan_of(scene(FLOOR, WALLS[wall], lights=[LAMP], sampling=sampled(1, 16, light=pattern)))
    places = np.linspace(-3, 3, 8)
    origins = np.stack([places, np.full(8, 1.0), np.linspace(-1, 1, 8)], axis=1)
    hits = renderer.trace(plan, origins, np.tile([0.0, -1.0, 0.0], (8, 1)))
    assert hits.shape.tolist() == [0] * 8
    assert hits.visibility[:, 0].tolist() == np.where(places < 0, 0.25, 0.75).tolist()


@pytest.mark.slow
def test_area_light_behind_many_triangles_is_as_behind_two() -> None:
    """From the floor, up to 700 of 39,200 triangles are between a point and the lamp."""
    sheet = [[-1.1, 1.5, -0.9], [0.9, 1.6, -1.2], [1.2, 1.5, 1.1], [-0.8, 1.4, 1]], [[0, 1, 2], [0, 2, 3]]
    light = lamp([-0.4, 3, -0.45], [0.8, 0.1, 0], [0, 0.05, 0.9])
    places = np.random.default_rng(4).uniform(-2, 2, (300, 3)) * [1, 0, 1]
    seen = []
    for parts in (1, 140):
        document = scene(FLOOR, mesh(*cut(*sheet, parts)), lights=[light], sampling=sampled(1, 16))
        ways = [0.0, -1.0, 0.0]
        hits = renderer.trace(plan_of(document, DOUBLE), np.add(places, [0, 0.5, 0]), np.tile(ways, (300, 1)))
        seen.append(hits.visibility[:, 0])
    np.testing.assert_array_equal(*seen)
    assert ((seen[0] > 0) & (seen[0] < 1)).sum() > 30


@pytest.mark.parametrize("wall", WALLS)
def test_area_light_half_covered(wall: str) -> None:
    """At the foot of a wall below the middle of a lamp half of the lamp is seen, and gives half its light."""
    document = scene(
        FLOOR,
        lights=[lamp([-2, 5, -2], [4, 0, 0], [0, 0, 4], [1, 1, 1], visible=False)],
        camera=camera(position=[-3, 4, 0], look_at=[-1e-9, 0, 0], vertical_fov=1e-6, width=1, height=1),
        ambient=[0, 0, 0],
        materials={"plain": phong([0.5, 0.25, 1.0], ambient=0.0, diffuse=1.0)},
        sampling=sampled(1, 64),
    )
    covered = document | {"shapes": [FLOOR, WALLS[wall]]}
    whole, half = (image_of(each, DOUBLE)[0, 0] for each in (document, covered))
    # The points are symmetric about the wall, and 1e-9 beside it the two halves differ by less than float32.
    assert (whole > 0.1).all()
    np.testing.assert_allclose(half, whole / 2, rtol=2.0**-22)
    hits = renderer.trace(plan_of(covered), [[-0.5, 1, 0], [1.5, 1, 0.3]], [[0, -1, 0]] * 2)
    assert hits.visibility[:, 0].tolist() == [0.5, 0.5]
