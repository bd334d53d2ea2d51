"""Every effect of the scene language is registered whole, and shown in a packaged scene."""

from collections.abc import Iterator
from dataclasses import fields, replace
from pathlib import Path
from typing import Any, Literal, get_args

import pytest
from pydantic import BaseModel

import scenes
from renderer.math.arrays import Floats
from renderer.plan.effects import LIGHTS, MATERIALS, SHAPES, TEXTURES, LightEffect, registered
from renderer.samplers import PATTERNS
from renderer.shapes import Family
from schemas import lights, shapes, textures
from schemas.base import members
from schemas.lights import Light
from schemas.materials import Material, PhongMaterial
from schemas.quality import Antialiasing, LightSampling
from schemas.reading import read_scene
from schemas.shapes import Shape, Triangle
from schemas.textures import Texture

SPHERE, BULB, SUN = SHAPES[shapes.Sphere], LIGHTS[lights.PointLight], LIGHTS[lights.DirectionalLight]


def test_effects_of_the_language_are_registered() -> None:
    tables: list[tuple[Any, Any]] = [
        (Shape, SHAPES),
        (Light, LIGHTS),
        (Material, MATERIALS),
        (Texture, TEXTURES),
    ]
    for union, table in tables:
        assert set(table) == set(members(union))
    named = [get_args(each.model_fields["pattern"].annotation) for each in (Antialiasing, LightSampling)]
    assert set(PATTERNS) == {*named[0], *named[1]}


def test_effects_are_shown_in_a_scene() -> None:
    """But for a single triangle, which is best seen as part of a mesh."""
    paths = Path(scenes.__file__).parent.glob("*/*.json")
    shown = {type(model) for path in paths for model in models(read_scene(path.read_bytes())[0])}
    effects = {model for union in (Shape, Material, Light, Texture) for model in members(union)}
    assert effects - shown <= {Triangle}


def models(value: Any) -> Iterator[BaseModel]:
    if isinstance(value, BaseModel):
        yield value
        value = {name: getattr(value, name) for name in type(value).model_fields}
    if isinstance(value, dict | tuple | list):
        for part in value.values() if isinstance(value, dict) else value:
            yield from models(part)


class Cone(shapes.Sphere):
    """A kind of shape that the renderer has never heard of."""

    type: Literal["cone"]  # type: ignore[assignment]


class Cones(Family):
    """Its family, which knows its hull and nothing else."""

    def corners(self) -> Floats:
        raise NotImplementedError


@pytest.mark.parametrize(
    "complete",
    [SPHERE, BULB, MATERIALS[PhongMaterial], TEXTURES[textures.ImageTexture]],
    ids=lambda x: type(x).__name__,
)
def test_effect_that_lacks_a_part_is_refused(complete: Any) -> None:
    """All but `cast`: segments cast the shadows of every family."""
    parts = {item.name: getattr(complete, item.name) for item in fields(complete)}
    for name in set(parts) - {"cast"}:
        others = {other: value for other, value in parts.items() if other != name}
        with pytest.raises(TypeError, match=name):
            type(complete)(**others)


def test_shape_that_is_not_whole_is_refused() -> None:
    with pytest.raises(TypeError, match="Cone"):
        registered(shapes.Sphere | Cone, {shapes.Sphere: SPHERE})
    with pytest.raises(TypeError, match=r"Cones .*shades_itself"):
        registered(Cone, {Cone: replace(SPHERE, family=Cones)})


@pytest.mark.parametrize(
    ("kind", "effect", "field"),
    [
        (lights.PointLight, replace(BULB, weights=()), "falloff"),
        (lights.SpotLight, replace(LIGHTS[lights.SpotLight], weights=BULB.weights), "outer_angle"),
        (lights.DirectionalLight, replace(SUN, weights=BULB.weights), "falloff"),
        (lights.RectangleLight, replace(LIGHTS[lights.RectangleLight], surface=False), "visible"),
    ],
    ids=["falloff is forgotten", "cone is forgotten", "falloff is in no scene", "surface is forgotten"],
)
def test_light_whose_effect_disagrees_is_refused(kind: Any, effect: LightEffect, field: str) -> None:
    with pytest.raises(TypeError, match=rf"{kind.__name__} .*'{field}'"):
        registered(kind, {kind: effect})
