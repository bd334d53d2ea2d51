"""Every effect of the scene language is rendered, tested, shown in the gallery or the documentation."""

from collections.abc import Iterator
from functools import cache
from typing import Any, Literal, get_args, get_origin

import pytest
from pydantic import BaseModel

from renderer.plan.effects import LIGHTS, SHAPES, TEXTURES
from renderer.samplers import PATTERNS
from schemas.base import members
from schemas.lights import Light
from schemas.materials import Material, PhongMaterial
from schemas.quality import Antialiasing, LightSampling
from schemas.reading import read_scene
from schemas.scene import Scene
from schemas.shapes import Shape
from schemas.textures import Texture
from tests.architecture.sources import ROOT


def literals(model: type[BaseModel], field: str) -> tuple[str, ...]:
    annotation = model.model_fields[field].annotation
    assert get_origin(annotation) is Literal
    return get_args(annotation)


TABLES = [(Shape, SHAPES), (Light, LIGHTS), (Texture, TEXTURES)]
EFFECTS = [model for union in (Shape, Material, Light, Texture) for model in members(union)]


@pytest.mark.parametrize(("union", "table"), TABLES, ids=["shapes", "lights", "textures"])
def test_every_class_of_the_language_has_one_line_in_the_renderers_table(
    union: Any, table: dict[type, Any]
) -> None:
    assert set(table) == set(members(union))


def test_the_renderer_knows_one_material() -> None:
    assert members(Material) == (PhongMaterial,)


def test_every_pattern_of_the_language_is_a_function_of_the_renderer() -> None:
    wanted = {*literals(Antialiasing, "pattern"), *literals(LightSampling, "pattern")}
    assert set(PATTERNS) == wanted


RENDERER_TESTS = [
    *(ROOT / "tests" / folder for folder in ("unit/renderer", "images", "numerics", "statistics")),
    ROOT / "accuracy" / "hard_cases",
]


@cache
def texts_of_tests() -> list[str]:
    """The text of every file that tests the renderer."""
    return [path.read_text() for folder in RENDERER_TESTS for path in folder.rglob("*.py")]


@pytest.mark.parametrize("effect", EFFECTS, ids=lambda model: model.__name__)
def test_every_effect_is_in_a_scene_that_tests_the_renderer(effect: type[BaseModel]) -> None:
    required = {name for name, field in effect.model_fields.items() if field.is_required()} - {
        "type",
        "material",
    }
    words = {f'"type": "{literals(effect, "type")[0]}"', *(f'"{name}"' for name in required)}
    assert any(all(word in text for word in words) for text in texts_of_tests())


@pytest.mark.parametrize("pattern", PATTERNS)
def test_every_pattern_is_in_a_test_of_the_renderer(pattern: str) -> None:
    assert any(f'"{pattern}"' in text for text in texts_of_tests())


@pytest.mark.parametrize("effect", EFFECTS, ids=lambda model: model.__name__)
def test_every_effect_is_shown_in_a_scene_or_described_in_the_documentation(
    effect: type[BaseModel],
) -> None:
    described = f"`{literals(effect, 'type')[0]}`" in (ROOT / "docs" / "reference" / "scenes.md").read_text()
    assert effect in shown() or described


@cache
def shown() -> set[type[BaseModel]]:
    """Classes that some scene of the gallery or the study uses."""
    return {type(model) for path in scene_files() for model in models(read_scene(path.read_bytes())[0])}


def scene_files() -> list[Any]:
    return sorted((ROOT / "scenes").glob("*/*.json"))


def models(value: Any) -> Iterator[BaseModel]:
    if isinstance(value, BaseModel):
        yield value
        for name in type(value).model_fields:
            yield from models(getattr(value, name))
    elif isinstance(value, dict):
        for part in value.values():
            yield from models(part)
    elif isinstance(value, tuple | list):
        for part in value:
            yield from models(part)


@pytest.mark.parametrize("path", scene_files(), ids=lambda path: f"{path.parent.name}/{path.stem}")
def test_every_scene_that_comes_along_is_read_without_a_warning(path: Any) -> None:
    scene, warnings = read_scene(path.read_bytes())
    assert isinstance(scene, Scene)
    assert warnings == ()


def test_the_gallery_says_what_to_notice_in_each_scene() -> None:
    text = (ROOT / "scenes" / "gallery" / "README.md").read_text()
    names = {path.name for path in scene_files() if path.parent.name == "gallery"}
    assert {name for name in names if name not in text} == set()
