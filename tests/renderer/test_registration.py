"""A kind of shape, light or texture that forgets something is refused when it is registered."""

from dataclasses import fields, replace
from typing import Any, Literal

import pytest

from renderer.math.arrays import Floats
from renderer.plan.effects import (
    LIGHTS,
    SHAPES,
    TEXTURES,
    LightEffect,
    ShapeEffect,
    TextureEffect,
    registered,
)
from renderer.shapes import Family
from schemas import lights, shapes, textures


class Cone(shapes.Sphere):
    """A kind of shape that the renderer has never heard of."""

    type: Literal["cone"]  # type: ignore[assignment]


class Cones(Family):
    """Its family, which knows its hull and nothing else."""

    def corners(self) -> Floats:
        raise NotImplementedError


SPHERE, BULB, SUN = SHAPES[shapes.Sphere], LIGHTS[lights.PointLight], LIGHTS[lights.DirectionalLight]


COMPLETE: dict[type, Any] = {
    ShapeEffect: SPHERE,
    LightEffect: BULB,
    TextureEffect: TEXTURES[textures.ImageTexture],
}


def test_shape_without_an_effect() -> None:
    with pytest.raises(TypeError, match=r"No effect is registered for Cone: add a line in renderer\.plan"):
        registered(shapes.Sphere | Cone, {shapes.Sphere: SPHERE})


@pytest.mark.parametrize("effect", [ShapeEffect, LightEffect, TextureEffect], ids=lambda kind: kind.__name__)
def test_effect_without_a_part(effect: type) -> None:
    """A shape without `cast` would be a picture without its shadows."""
    complete = {ShapeEffect: SPHERE, LightEffect: BULB, TextureEffect: TEXTURES[textures.ImageTexture]}[
        effect
    ]
    parts = {item.name: getattr(complete, item.name) for item in fields(effect)}
    for name in parts:
        others = {other: value for other, value in parts.items() if other != name}
        with pytest.raises(TypeError, match=name):
            effect(**others)


def test_family_without_self_shading() -> None:
    with pytest.raises(TypeError, match=r"Cone cannot be registered: Cones does not define .*shades_itself"):
        registered(Cone, {Cone: replace(SPHERE, family=Cones)})


@pytest.mark.parametrize(
    ("kind", "effect", "field"),
    [
        (lights.PointLight, replace(BULB, falloff=None), "falloff"),
        (lights.DirectionalLight, replace(SUN, falloff=BULB.falloff), "falloff"),
        (lights.RectangleLight, replace(LIGHTS[lights.RectangleLight], surface=False), "visible"),
    ],
    ids=["falloff is forgotten", "falloff is in no scene", "surface is forgotten"],
)
def test_light_whose_fields_disagree(kind: Any, effect: LightEffect, field: str) -> None:
    with pytest.raises(TypeError, match=rf"{kind.__name__} cannot be registered: .*'{field}'"):
        registered(kind, {kind: effect})
