"""What a study renders."""

from __future__ import annotations

from pathlib import Path

import pytest
from PIL import Image

from accuracy.study.program import Program
from accuracy.study.settings import FULL, METHODS, PATTERNS, QUICK, fixed, swept
from accuracy.study.tasks import Subject, Task
from renderer import load_scene
from tests.accuracy.study.scenes import SCENE, TINY, scene

POINT_LIGHT = {"type": "point", "position": [1, 3, 1], "color": [0.8, 0.8, 0.8]}


def program(**members: object) -> Program:
    return Program(scene(**members), TINY, "here")


def tasks(of: Program) -> list[Task]:
    return of.rounds(of.references(16))


@pytest.mark.parametrize("scale", [FULL, QUICK, TINY])
def test_every_method_is_tried_and_no_setting_twice(scale: object) -> None:
    settings = list(swept(scale, area_lights=True))  # type: ignore[arg-type]
    assert {setting.method for setting in settings} == set(METHODS)
    names = [setting.name for setting in settings]
    assert len(set(names)) == len(names)


def test_without_area_lights_the_number_of_their_points_is_not_varied() -> None:
    point = program(lights=[POINT_LIGHT])
    assert not point.area_lights
    assert {setting.points for setting in point.settings if setting.method in PATTERNS} == {1}
    assert program().area_lights


def test_pictures_have_at_most_the_side_of_the_study_and_the_shape_of_the_scene() -> None:
    camera = program().subject.scene.document.camera
    assert (camera.width, camera.height) == (20, 15)


def test_a_scene_smaller_than_the_study_keeps_its_size() -> None:
    camera = SCENE["camera"] | {"width": 10, "height": 16}
    small = program(camera=camera)
    assert small.subject.scene.document.camera.width == 10
    assert not [task for task in tasks(small) if task.part == "size"]


def test_each_round_has_its_own_seed_and_goes_from_cheap_to_expensive() -> None:
    of = program()
    for seed in (1, 2):
        settings = [task for task in tasks(of) if task.part == "setting" and task.seed == seed]
        prices = [of.price(task) for task in settings]
        assert prices == sorted(prices)
        assert len(settings) == len(of.settings)


def test_the_seeds_of_the_reference_are_no_others() -> None:
    of = program()
    halves = {task.seed for task in of.references(16)}
    assert len(halves) == 2
    assert halves.isdisjoint(task.seed for task in tasks(of))


def test_a_picture_comes_after_the_one_that_it_is_compared_with() -> None:
    order = tasks(program())
    compared = [task for task in order if task.against]
    assert {task.part for task in compared} == {"precision", "effect"}
    for task in compared:
        assert task.against is not None
        assert task.against.kept
        keys = [known.key for known in order]
        assert keys.index(task.against.key) < keys.index(task.key)


def test_each_effect_is_left_out_once_a_round() -> None:
    effects = [(task.name, task.subject.pointers) for task in tasks(program()) if task.part == "effect"]
    once = [
        ("light 0", ("/lights/0",)),
        ("highlights", ("/materials/ball/specular",)),
        ("antialiasing", ("/sampling/antialiasing",)),
    ]
    assert sorted(effects) == sorted(2 * once)


def test_double_precision_is_the_same_setting_in_another_arithmetic() -> None:
    for task in tasks(program()):
        if task.part == "precision":
            assert task.against is not None
            assert task.quality.precision == "double"
            assert task.quality.model_copy(update={"precision": "single"}) == task.against.quality


def test_what_is_expensive_is_rendered_once() -> None:
    of = program(camera=SCENE["camera"] | {"width": 4000, "height": 4000})
    large = Program(of.scene, FULL, "here")
    runs = [task.name for task in large.rounds(large.references(16)) if task.part == "setting"]
    assert runs.count("sobol 64 x 4") == 1
    assert runs.count("sobol 1 x 1") == FULL.seeds


def key(**changes: object) -> str:
    members = {"subject": program().subject, "quality": fixed("sobol", 4, 4).quality, "seed": 1, "place": ""}
    return Task("setting", "name", **(members | changes)).key  # type: ignore[arg-type]


def test_a_run_is_the_same_whatever_the_scene_is_called_and_however_it_is_displayed() -> None:
    other = program(name="another", display={"transfer": "linear"}, sampling={"seed": 7})
    assert key(subject=other.subject) == key()


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
def test_a_run_is_another_one_where_anything_that_matters_differs(changes: dict[str, object]) -> None:
    assert key(**changes) != key()


def test_a_run_is_another_one_when_a_file_of_its_scene_changes(tmp_path: Path) -> None:
    document = SCENE | {"textures": {"wood": {"type": "image", "asset": "wood.png"}}}

    def painted(color: tuple[int, int, int]) -> str:
        import json

        Image.new("RGB", (2, 2), color).save(tmp_path / "wood.png")
        (tmp_path / "scene.json").write_text(json.dumps(document))
        return Subject.of(load_scene(tmp_path / "scene.json")).key

    assert painted((255, 0, 0)) == painted((255, 0, 0))
    assert painted((255, 0, 0)) != painted((0, 255, 0))
