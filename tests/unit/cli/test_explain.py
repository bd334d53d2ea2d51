from __future__ import annotations

from pathlib import Path

from renderer import compile_scene, load_scene
from tests.unit.cli.conftest import Penumbra


def test_the_plan_is_that_of_the_renderer(penumbra: Penumbra, scene_file: Path) -> None:
    plan = compile_scene(load_scene(scene_file)).describe().model_dump(mode="json")
    assert penumbra("explain", scene_file, "--json").document == plan
    lines = [line.split("\t") for line in penumbra("explain", scene_file).out.splitlines()]
    assert [line[1] for line in lines if line[0] == "runs"] == [stage["name"] for stage in plan["stages"]]
    assert [line[1] for line in lines if line[0] == "left out"] == [out["effect"] for out in plan["left_out"]]


def test_more_samples_are_predicted_to_cost_more(penumbra: Penumbra, scene_file: Path) -> None:
    one, nine = (
        penumbra("explain", scene_file, "--json", "--samples", n, "--pattern", "uniform") for n in (1, 9)
    )
    assert nine.document["cost"]["camera_rays"] == 9 * one.document["cost"]["camera_rays"]
    assert nine.document["cost"]["cpu_seconds"] > one.document["cost"]["cpu_seconds"]


def test_costs_are_measured_for_each_effect_with_who_asked(penumbra: Penumbra, scene_file: Path) -> None:
    plain = penumbra("explain", scene_file, "--json").document
    whole = penumbra("explain", scene_file, "--json", "--cost").document
    measured = whole.pop("measured")
    assert whole == plain
    assert measured["cpu_seconds"] > 0
    effects = {row["effect"]: row for row in measured["effects"]}
    assert effects["light 0"]["pointers"] == ["/lights/0"]
    assert effects["light 0"]["difference"] > 0
    lines = penumbra("explain", scene_file, "--cost").out.splitlines()
    assert sum(line.startswith("measured\t") for line in lines) == len(effects)
