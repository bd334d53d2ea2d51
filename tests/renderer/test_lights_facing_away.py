"""A lamp that shines to one side only, away from every shape, is left out; nothing else changes."""

from typing import Any

import numpy as np
import pytest

import renderer
from accuracy.hard_cases.documents import (
    Json,
    ellipsoid,
    lamp,
    phong,
    rectangle,
    sampled,
    scene,
    sphere,
    sun,
    triangle,
)
from tests.pictures.parts import plan_of, png

UP, DOWN = ([0, 0, 2], [2, 0, 0]), ([2, 0, 0], [0, 0, 2])
"""Edges of a lamp whose front is its upper or its lower side."""

FLOOR = rectangle([-4, 0, -4], [0, 0, 8], [8, 0, 0])
TRIANGLE = triangle([0, 0, 0], [1, 0.5, 0], [0, 2, 0])
SUN = sun([0.2, -1, -0.3])
BUMPS = png(np.full((4, 4, 3), 255, dtype=np.uint8))
RAISED = phong(displacement_map="bumps", displacement_height=0.5)
FILES = {"bumps.png": BUMPS}


def above(height: float, edges: Any = UP, **changes: Any) -> Json:
    """A lamp over the floor that shines up."""
    return lamp([-1, height, -1], *edges, **({"two_sided": False, "visible": False} | changes))


def drawn(*shapes: Json, lights: list[Json], **changes: Any) -> renderer.RenderPlan:
    return plan_of(
        scene(*shapes, lights=lights, sampling=sampled(4, 4, "sobol", "sobol"), **changes), files=FILES
    )


def left_out(plan: renderer.RenderPlan) -> list[str]:
    return [item.reason for item in plan.left_out if item.effect == "lights.rectangle"]


SHAPES: dict[str, Json] = {
    "rectangle": rectangle([-1, 1, 0], [2, 0, 0], [0, 1, 0]),
    "triangle": TRIANGLE,
    "ball": sphere([0, 1, 0], 1),
    "tilted ellipsoid": ellipsoid([0, 1, 0], [0.8, 0.6, 0], [-0.6, 0.8, 0], [0, 0, 1]),
    "mesh": {
        "type": "mesh",
        "vertices": [[-1, 0, 0], [1, 0, 0], [0, 1, 0]],
        "triangles": [[0, 1, 2]],
        "translate": [0, 1, 0],
        "material": "plain",
    },
}
"""Each reaches up to a height of 2."""


@pytest.mark.parametrize("name", SHAPES)
def test_lamp_that_shines_away_is_left_out(name: str) -> None:
    plan = drawn(FLOOR, SHAPES[name], lights=[SUN, above(2.001)])
    assert left_out(plan) == ["/lights/1 faces away from every shape"]
    assert [lighting.emitter.number for lighting in plan.lightings] == [0]
    assert not any("/lights/1" in entry.pointers for entry in plan.entries)


@pytest.mark.parametrize("name", SHAPES)
@pytest.mark.parametrize("height", [2.0, 1.999, 0.5, -1.0])
def test_lamp_that_a_shape_reaches_stays(name: str, height: float) -> None:
    """At 2.0 it just touches the shape: whether a point is lit, the points say."""
    plan = drawn(FLOOR, SHAPES[name], lights=[above(height)])
    assert left_out(plan) == []
    assert len(plan.lightings) == 1


def test_displaced_shape_reaches_a_lamp() -> None:
    changes: Json = {
        "materials": {"plain": phong(), "raised": RAISED},
        "textures": {"bumps": {"type": "image", "asset": "bumps.png", "encoding": "linear"}},
    }
    raised = FLOOR | {"material": "raised"}
    assert left_out(drawn(raised, lights=[above(0.499)], **changes)) == []
    assert len(left_out(drawn(raised, lights=[above(0.501)], **changes))) == 1


@pytest.mark.parametrize("falloff", ["none", "physical"])
@pytest.mark.parametrize("height", [2.001, 2.0])
@pytest.mark.parametrize("name", SHAPES)
def test_same_bytes_without_the_lamp(name: str, height: float, falloff: str) -> None:
    """Also of a lamp that just touches and is therefore not left out."""
    shapes = (FLOOR, SHAPES[name])
    materials = {"plain": phong(specular=0.4, shininess=30, mirror=0.3)}
    bare = renderer.render(drawn(*shapes, lights=[SUN], materials=materials))
    lit = renderer.render(drawn(*shapes, lights=[SUN, above(height, falloff=falloff)], materials=materials))
    assert lit.image.tobytes() == bare.image.tobytes()
    assert lit.report["rays"] == bare.report["rays"]


@pytest.mark.parametrize("eye", [5, 0.5], ids=["from its bright side", "from behind"])
def test_left_out_lamp_is_seen(eye: float) -> None:
    color = [0.25, 0.5, 0.75]
    view = {"position": [0, eye, 0], "look_at": [0, 2, 0], "up": [0, 0, -1], "width": 3, "height": 3}
    plan = drawn(FLOOR, lights=[above(2, visible=True, color=color)], camera=view)
    assert len(left_out(plan)) == 1
    assert renderer.render(plan).image[1, 1].tolist() == color


def test_lamp_within_rounding_stays() -> None:
    """At 2**20 a hair is 2**20 * 2**-40: nearer than that the coordinates may lie."""
    far = 2.0**20
    floor = rectangle([-4, far, -4], [0, 0, 8], [8, 0, 0])
    assert left_out(drawn(floor, lights=[above(far + 2.0**-21)])) == []
    assert len(left_out(drawn(floor, lights=[above(far + 2.0**-10)]))) == 1


@pytest.mark.parametrize("direction", np.random.default_rng(5).normal(size=(8, 3)), ids=str)
def test_reach_of_an_ellipsoid(direction: Any) -> None:
    """The farthest point has the direction as its normal: M M^T d over |M^T d| from the centre."""
    (family,) = (
        stage.family  # type: ignore[attr-defined]
        for stage in drawn(
            ellipsoid([1, 2, 3], [2, 1, 0], [-0.5, 1, 0], [0, 0, 3]), lights=[SUN]
        ).intersectors
    )
    axes = np.array([[2, 1, 0], [-0.5, 1, 0], [0, 0, 3]])
    farthest = np.array([1, 2, 3]) + axes.T @ (axes @ direction) / np.linalg.norm(axes @ direction)
    bound = 16 * np.finfo(float).eps * np.abs(direction).max() * (6 + 7.5)
    assert abs(family.reach(direction[:, None])[0] - farthest @ direction) <= bound
