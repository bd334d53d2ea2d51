"""The renders of a study."""

import json
from pathlib import Path

import pytest
from PIL import Image

from accuracy.study.program import Program
from accuracy.study.settings import FULL, METHODS, QUICK, fixed, swept
from accuracy.study.tasks import Subject, Task
from renderer import load_scene
from tests.accuracy.study.scenes import SCENE, TINY, scene


def program(**members: object) -> Program:
    return Program(scene(**members), TINY, "here")


def tasks(of: Program) -> list[Task]:
    return of.rounds(of.references(16))


@pytest.mark.parametrize("scale", [FULL, QUICK, TINY])
def test_methods_are_all_tried_and_no_setting_twice(scale: object) -> None:
    settings = list(swept(scale, area_lights=True))  # type: ignore[arg-type]
    assert {setting.method for setting in settings} == set(METHODS)
    names = [setting.name for setting in settings]
    assert len(set(names)) == len(names)


def test_pictures_have_at_most_the_side_of_the_study() -> None:
    size = program().subject.scene.document.camera
    assert (size.width, size.height) == (20, 15)
    small = program(camera=SCENE["camera"] | {"width": 10, "height": 16})
    assert small.subject.scene.document.camera.width == 10
    assert not [task for task in tasks(small) if task.part == "size"]


def test_rounds_have_their_own_seeds_and_begin_with_the_cheapest() -> None:
    of = program()
    for seed in (1, 2):
        settings = [task for task in tasks(of) if task.part == "setting" and task.seed == seed]
        prices = [of.price(task) for task in settings]
        assert prices == sorted(prices)
        assert len(settings) == len(of.settings)
    halves = {task.seed for task in of.references(16)}
    assert len(halves) == 2
    assert halves.isdisjoint(task.seed for task in tasks(of))


def test_picture_comes_after_the_one_it_is_compared_with() -> None:
    order = tasks(program())
    keys = [known.key for known in order]
    compared = [task for task in order if task.against]
    assert {task.part for task in compared} == {"precision", "effect"}
    for task in compared:
        assert task.against is not None
        assert task.against.kept
        assert keys.index(task.against.key) < keys.index(task.key)
        if task.part == "precision":
            assert task.quality.precision == "double"
            assert task.quality.model_copy(update={"precision": "single"}) == task.against.quality


def test_effects_are_left_out_once_a_round() -> None:
    effects = [(task.name, task.subject.pointers) for task in tasks(program()) if task.part == "effect"]
    once = [
        ("light 0", ("/lights/0",)),
        ("highlights", ("/materials/ball/specular",)),
        ("antialiasing", ("/sampling/antialiasing",)),
    ]
    assert sorted(effects) == sorted(2 * once)


def key(**changes: object) -> str:
    members = {"subject": program().subject, "quality": fixed("sobol", 4, 4).quality, "seed": 1, "place": ""}
    return Task("setting", "name", **(members | changes)).key  # type: ignore[arg-type]


@pytest.mark.parametrize(
    "changes",
    [
        {"seed": 2},
        {"place": "elsewhere"},
        {"kept": True},
        {"quality": fixed("sobol", 4, 4, "double").quality},
        {"subject": program(ambient=[1, 1, 0.5]).subject},
        {"judges": program().references(16)},
    ],
    ids=["seed", "machine", "kept", "quality", "scene", "reference"],
)
def test_key_differs_with_anything_that_matters(changes: dict[str, object]) -> None:
    """Not with the name of the scene, how it is displayed, or its own seed."""
    other = program(name="another", display={"transfer": "linear"}, sampling={"seed": 7})
    assert key(subject=other.subject) == key() != key(**changes)


def test_setting_that_is_expensive_is_rendered_once() -> None:
    large = Program(scene(camera=SCENE["camera"] | {"width": 4000, "height": 4000}), FULL, "here")
    runs = [task.name for task in large.rounds(large.references(16)) if task.part == "setting"]
    assert (runs.count("sobol 64 x 4"), runs.count("sobol 1 x 1")) == (1, FULL.seeds)


def test_key_differs_with_the_files_of_a_scene(tmp_path: Path) -> None:
    document = SCENE | {"textures": {"wood": {"type": "image", "asset": "wood.png"}}}
    (tmp_path / "scene.json").write_text(json.dumps(document))

    def painted(color: tuple[int, int, int]) -> str:
        Image.new("RGB", (2, 2), color).save(tmp_path / "wood.png")
        return Subject.of(load_scene(tmp_path / "scene.json")).key

    assert painted((255, 0, 0)) == painted((255, 0, 0)) != painted((0, 255, 0))
