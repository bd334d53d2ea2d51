"""A one-sided lamp that faces away from every shape is left out."""

from typing import Any

import numpy as np
import pytest

import renderer
from tests.documents import (
    Json,
    ellipsoid,
    lamp,
    mesh,
    phong,
    rectangle,
    sampled,
    scene,
    sphere,
    sun,
    triangle,
)
from tests.pictures.parts import plan_of, png

FLOOR = rectangle([-4, 0, -4], [0, 0, 8], [8, 0, 0])
SUN = sun([0.2, -1, -0.3])
FILES = {"bumps.png": png(np.full((4, 4, 3), 255, dtype=np.uint8))}
SHAPES: dict[str, Json] = {
    "rectangle": rectangle([-1, 1, 0], [2, 0, 0], [0, 1, 0]),
    "triangle": triangle([0, 0, 0], [1, 0.5, 0], [0, 2, 0]),
    "ball": sphere([0, 1, 0], 1),
    "tilted ellipsoid": ellipsoid([0, 1, 0], [0.8, 0.6, 0], [-0.6, 0.8, 0], [0, 0, 1]),
    "mesh": mesh([[-1, 0, 0], [1, 0, 0], [0, 1, 0]], [[0, 1, 2]], translate=[0, 1, 0]),
}
"""Each reaches up to a height of 2."""


def above(height: float, **changes: Any) -> Json:
    """A lamp over the floor that shines up."""
    return lamp([-1, height, -1], [0, 0, 2], [2, 0, 0], **({"two_sided": False, "visible": False} | changes))


def drawn(*shapes: Json, lights: list[Json], **changes: Any) -> renderer.RenderPlan:
    sampling = sampled(4, 4, "sobol", "sobol")
    return plan_of(scene(*shapes, lights=lights, sampling=sampling, **changes), files=FILES)


def left_out(plan: renderer.RenderPlan) -> int:
    return sum(item.effect == "lights.rectangle" for item in plan.left_out)


@pytest.mark.parametrize("name", SHAPES)
def test_lamp_above_every_shape_is_left_out(name: str) -> None:
    """At 2.0 it just touches the shape: whether a point is lit, the points say."""
    for height in (2.0, 1.999, 0.5, -1.0):
        assert left_out(drawn(FLOOR, SHAPES[name], lights=[above(height)])) == 0
    plan = drawn(FLOOR, SHAPES[name], lights=[SUN, above(2.001)])
    assert left_out(plan) == 1
    assert [lighting.emitter.number for lighting in plan.lightings] == [0]
    assert not any("/lights/1" in entry.pointers for entry in plan.entries)


def test_lamp_is_compared_with_displaced_shapes() -> None:
    changes: Json = {
        "materials": {"raised": phong(displacement_map="bumps", displacement_height=0.5)},
        "textures": {"bumps": {"type": "image", "asset": "bumps.png", "encoding": "linear"}},
    }
    raised = FLOOR | {"material": "raised"}
    assert left_out(drawn(raised, lights=[above(0.499)], **changes)) == 0
    assert left_out(drawn(raised, lights=[above(0.501)], **changes)) == 1


@pytest.mark.parametrize("falloff", ["none", "physical"])
@pytest.mark.parametrize("name", SHAPES)
def test_picture_has_the_bytes_without_the_lamp(name: str, falloff: str) -> None:
    """Also of a lamp that just touches and is therefore not left out."""
    shapes = (FLOOR, SHAPES[name])
    materials = {"plain": phong(specular=0.4, shininess=30, mirror=0.3)}
    bare, *lit = (
        renderer.render(drawn(*shapes, lights=[SUN, *lamps], materials=materials))
        for lamps in ([], [above(2.001, falloff=falloff)], [above(2.0, falloff=falloff)])
    )
    for each in lit:
        assert each.image.tobytes() == bare.image.tobytes()
        assert each.report["rays"] == bare.report["rays"]


@pytest.mark.parametrize("eye", [5, 0.5], ids=["from its bright side", "from behind"])
def test_lamp_left_out_is_still_seen(eye: float) -> None:
    color = [0.25, 0.5, 0.75]
    view = {"position": [0, eye, 0], "look_at": [0, 2, 0], "up": [0, 0, -1], "width": 3, "height": 3}
    plan = drawn(FLOOR, lights=[above(2, visible=True, color=color)], camera=view)
    assert left_out(plan) == 1
    assert renderer.render(plan).image[1, 1].tolist() == color


def test_lamp_within_rounding_of_a_shape_stays() -> None:
    """At 2**20 a hair is 2**20 * 2**-40: nearer than that the coordinates may lie."""
    far = 2.0**20
    floor = rectangle([-4, far, -4], [0, 0, 8], [8, 0, 0])
    assert left_out(drawn(floor, lights=[above(far + 2.0**-21)])) == 0
    assert left_out(drawn(floor, lights=[above(far + 2.0**-10)])) == 1
