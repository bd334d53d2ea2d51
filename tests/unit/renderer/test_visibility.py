"""Shares of lamps that are seen past shapes, by halves and quarters that are exact."""

import numpy as np
import pytest

import renderer
from accuracy.hard_cases.documents import lamp, rectangle, sampled, scene, triangle
from tests.images.parts import plan_of

FLOOR = rectangle([-9, 0, -9], [0, 0, 18], [18, 0, 0])
LAMP = lamp([-1, 5, -2], [4, 0, 0], [0, 0, 4])
WALLS = {
    "rectangle": rectangle([0, -9, -90], [0, 0, 180], [0, 90, 0]),
    "triangle": triangle([0, -900, -900], [0, 900, 0], [0, -900, 900]),
}


@pytest.mark.parametrize("pattern", ["uniform", "stratified", "sobol"])
@pytest.mark.parametrize("wall", WALLS)
def test_a_wall_through_a_lamp_leaves_each_side_its_share(wall: str, pattern: str) -> None:
    """The wall cuts a quarter of the lamp off, along cells: in each there is one of 16 points."""
    plan = plan_of(scene(FLOOR, WALLS[wall], lights=[LAMP], sampling=sampled(1, 16, light=pattern)))
    places = np.linspace(-3, 3, 8)
    origins = np.stack([places, np.full(8, 1.0), np.linspace(-1, 1, 8)], axis=1)
    hits = renderer.trace(plan, origins, np.tile([0.0, -1.0, 0.0], (8, 1)))
    assert hits.shape.tolist() == [0] * 8
    assert hits.visibility[:, 0].tolist() == np.where(places < 0, 0.25, 0.75).tolist()
