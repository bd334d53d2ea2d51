from __future__ import annotations

import os
from pathlib import Path

import pytest

from renderer import compile_scene, load_scene
from schemas.quality import TargetQuality
from tests.service.cli.conftest import Penumbra


def test_plan_of_the_renderer(here: Penumbra, scene_file: Path) -> None:
    plan = compile_scene(load_scene(scene_file)).describe().model_dump(mode="json")
    assert here("explain", scene_file, "--json").document == plan
    lines = [line.split("\t") for line in here("explain", scene_file).out.splitlines()]
    assert [line[1] for line in lines if line[0] == "runs"] == [stage["name"] for stage in plan["stages"]]
    assert [line[1] for line in lines if line[0] == "left out"] == [out["effect"] for out in plan["left_out"]]


def test_samples_raise_the_cost(here: Penumbra, scene_file: Path) -> None:
    one, nine = (
        here("explain", scene_file, "--json", "--samples", n, "--pattern", "uniform") for n in (1, 9)
    )
    assert nine.document["cost"]["camera_rays"] == 9 * one.document["cost"]["camera_rays"]
    assert nine.document["cost"]["cpu_seconds"] > one.document["cost"]["cpu_seconds"]


def test_measured_effects(here: Penumbra, scene_file: Path) -> None:
    plain = here("explain", scene_file, "--json").document
    whole = here("explain", scene_file, "--json", "--cost").document
    measured = whole.pop("measured")
    assert whole == plain
    assert measured["cpu_seconds"] > 0
    effects = {row["effect"]: row for row in measured["effects"]}
    assert effects["light 0"]["pointers"] == ["/lights/0"]
    assert effects["light 0"]["difference"] > 0
    lines = here("explain", scene_file, "--cost").out.splitlines()
    assert sum(line.startswith("measured\t") for line in lines) == len(effects)


def test_pilot_samples(here: Penumbra, scene_file: Path) -> None:
    target = TargetQuality(mode="target", error=0.004, confidence=0.8, time_limit=9.0)
    plan = compile_scene(load_scene(scene_file), target).describe().model_dump(mode="json")
    options = ("--target-error", 0.004, "--confidence", 0.8, "--time-limit", 9)
    found = here("explain", scene_file, "--json", *options).document
    assert found["pilot_samples"] == plan["pilot_samples"] != []
    assert found["stages"] == plan["stages"]
    lines = [line.split("\t") for line in here("explain", scene_file, *options).out.splitlines()]
    reported = [(line[1], line[4]) for line in lines if line[0] == "pilot samples"]
    assert reported == [(stage["name"], stage["detail"]) for stage in plan["pilot_samples"]]


def test_smaller_error_costs_more(here: Penumbra, scene_file: Path) -> None:
    coarse, fine, short = (
        here("explain", scene_file, "--json", "--target-error", *words).document["cost"]
        for words in ((0.004,), (0.001,), (0.001, "--time-limit", 0.000001))
    )
    assert fine["cpu_seconds"] == pytest.approx(4 * coarse["cpu_seconds"], rel=1e-12)
    assert short["cpu_seconds"] <= 0.000001 * (os.cpu_count() or 1)
