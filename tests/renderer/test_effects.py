"""Every effect of the scene language is registered, and shown in a scene."""

from collections.abc import Iterator
from functools import cache
from pathlib import Path
from typing import Any, get_args

import pytest
from pydantic import BaseModel

from renderer.plan.effects import LIGHTS, SHAPES, TEXTURES
from renderer.samplers import PATTERNS
from schemas.base import members
from schemas.lights import Light
from schemas.materials import Material
from schemas.quality import Antialiasing, LightSampling
from schemas.reading import read_scene
from schemas.shapes import Shape, Triangle
from schemas.textures import Texture

ROOT = Path(__file__).parents[2]
TABLES = [(Shape, SHAPES), (Light, LIGHTS), (Texture, TEXTURES)]
EFFECTS = [model for union in (Shape, Material, Light, Texture) for model in members(union)]


def literals(model: type[BaseModel], field: str) -> tuple[str, ...]:
    return get_args(model.model_fields[field].annotation)


@pytest.mark.parametrize(("union", "table"), TABLES, ids=["shapes", "lights", "textures"])
def test_effects_of_the_language_are_registered(union: Any, table: dict[type, Any]) -> None:
    assert set(table) == set(members(union))


def test_patterns_of_the_language_are_registered() -> None:
    assert set(PATTERNS) == {*literals(Antialiasing, "pattern"), *literals(LightSampling, "pattern")}


# A triangle alone is best seen as part of a mesh.
@pytest.mark.parametrize("effect", sorted({*EFFECTS} - {Triangle}, key=str), ids=lambda model: model.__name__)
def test_effects_are_shown_in_a_scene(effect: type[BaseModel]) -> None:
    assert effect in shown()


@cache
def shown() -> set[type[BaseModel]]:
    """Classes that some packaged scene uses."""
    paths = (ROOT / "scenes").glob("*/*.json")
    return {type(model) for path in paths for model in models(read_scene(path.read_bytes())[0])}


def models(value: Any) -> Iterator[BaseModel]:
    if isinstance(value, BaseModel):
        yield value
        value = {name: getattr(value, name) for name in type(value).model_fields}
    if isinstance(value, dict | tuple | list):
        for part in value.values() if isinstance(value, dict) else value:
            yield from models(part)
