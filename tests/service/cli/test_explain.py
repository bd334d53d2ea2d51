"""Plans and predicted costs before a render begins: ``explain`` and ``quote``."""

import io
import json
import os
from pathlib import Path
from typing import Any

import pytest
from rich.console import Console

from renderer import compile_scene, load_scene
from schemas.api.plans import Quote
from schemas.quality import Antialiasing, FixedQuality, LightSampling, TargetQuality
from service.cli.quote import offers, options, short
from tests.service.cli.conftest import Penumbra

TARGET = TargetQuality(mode="target", error=0.004, confidence=0.8, time_limit=9.0)
OPTIONS = ("--target-error", 0.004, "--confidence", 0.8, "--time-limit", 9)


@pytest.mark.parametrize(("options", "quality"), [((), None), (OPTIONS, TARGET)], ids=["samples", "target"])
def test_plan_of_the_renderer(
    here: Penumbra, scene_file: Path, options: tuple[object, ...], quality: TargetQuality | None
) -> None:
    plan = compile_scene(load_scene(scene_file), quality).describe().model_dump(mode="json")
    found = here("explain", scene_file, "--json", *options).document
    assert found | {"cost": 0} == plan | {"cost": 0}
    lines = [line.split("\t") for line in here("explain", scene_file, *options).out.splitlines()]
    for kind, names in {
        "runs": [stage["name"] for stage in plan["stages"]],
        "left out": [out["effect"] for out in plan["left_out"]],
        "pilot samples": [stage["name"] for stage in plan["pilot_samples"]],
    }.items():
        assert [line[1] for line in lines if line[0] == kind] == names


def test_samples_and_smaller_errors_cost_more(here: Penumbra, scene_file: Path) -> None:
    one, nine, coarse, fine, short = (
        here("explain", scene_file, "--json", *words).document["cost"]
        for words in (
            ("--samples", 1),
            ("--samples", 9),
            ("--target-error", 0.004),
            ("--target-error", 0.001),
            ("--target-error", 0.001, "--time-limit", 0.000001),
        )
    )
    assert nine["camera_rays"] == 9 * one["camera_rays"]
    assert nine["cpu_seconds"] > one["cpu_seconds"]
    assert fine["cpu_seconds"] == pytest.approx(4 * coarse["cpu_seconds"], rel=1e-12)
    assert short["cpu_seconds"] <= 0.000001 * (os.cpu_count() or 1)


def test_commands_need_no_processor_affinity(
    here: Penumbra, scene_file: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Only Linux reports it."""
    monkeypatch.delattr(os, "sched_getaffinity")
    for words in (("explain", scene_file), ("doctor",)):
        assert here(*words, "--json").code == 0


def test_measured_effects(here: Penumbra, scene_file: Path) -> None:
    measured = here("explain", scene_file, "--json", "--cost").document["measured"]
    assert measured["cpu_seconds"] > 0
    effects = {row["effect"]: row for row in measured["effects"]}
    assert effects["light 0"]["pointers"] == ["/lights/0"]
    assert effects["light 0"]["difference"] > 0
    lines = here("explain", scene_file, "--cost").out.splitlines()
    assert sum(line.startswith("measured\t") for line in lines) == len(effects)


SOBOL = FixedQuality(
    mode="fixed",
    antialiasing=Antialiasing(pattern="sobol", samples=16),
    light=LightSampling(pattern="sobol", samples=4),
    precision="double",
)
TARGET = TargetQuality(mode="target", error=0.004, time_limit=2.5)


def test_quote_as_document_and_table(here: Penumbra, scene_file: Path) -> None:
    words = ("--target-error", 0.02, "--time", 5, "--workers", 3, "--samples", 4, "--pattern", "sobol")
    found = Quote.model_validate(here("quote", scene_file, "--json", *words).document)
    assert found.workers == 3
    assert found.asked is not None
    assert isinstance(found.asked.quality, FixedQuality)
    assert found.asked.quality.antialiasing == Antialiasing(pattern="sobol", samples=4)
    assert found.for_error is not None
    assert found.for_seconds is not None
    console = Console(width=80, file=io.StringIO())
    with console.capture() as shown:
        console.print(offers(found))
    rows = [line.split("  ")[1].strip() for line in shown.get().splitlines() if " (" in line]
    assert rows == [short(offer.quality) for offer in found.offers]
    assert "target 4/255" in rows


def test_offer_is_a_line_on_a_pipe(here: Penumbra, scene: dict[str, Any], scene_file: Path) -> None:
    scene["camera"] |= {"width": 256, "height": 256}
    scene_file.write_text(json.dumps(scene))
    # Whether an error can be reached depends on how far pilot samples come; a picture takes a millisecond.
    outcome = here("quote", scene_file, "--target-error", 0.02, "--time", 0.001)
    lines = [line.split("\t") for line in outcome.out.splitlines()]
    kinds = [line[0] for line in lines]
    assert kinds.count("asked") == kinds.count("for error") == 1
    assert ["for time", "nothing that was tried", "", "", ""] in lines
    offered = {line[1]: line[2:] for line in lines if line[0] == "offer"}
    asked = next(line for line in lines if line[0] == "asked")
    assert offered[asked[1]] == asked[2:]
    seconds, cpu_seconds = (tuple(map(float, cell.split())) for cell in asked[2:4])
    assert seconds[1] <= seconds[0] <= seconds[2]
    assert seconds[0] <= cpu_seconds[0]


@pytest.mark.parametrize(
    ("quality", "command"),
    [
        (SOBOL, "--samples 16 --pattern sobol --light-samples 4 --light-pattern sobol --precision double"),
        (TARGET, "--target-error 0.004 --time-limit 2.5"),
        (
            TARGET.model_copy(update={"confidence": 0.99}),
            "--target-error 0.004 --confidence 0.99 --time-limit 2.5",
        ),
    ],
    ids=["samples", "target", "confidence"],
)
def test_options_of_an_offer(quality: FixedQuality | TargetQuality, command: str) -> None:
    assert options(quality) == command


@pytest.mark.parametrize(("option", "value"), [("--target-error", 2), ("--time", 0), ("--workers", 0)])
def test_invalid_options(here: Penumbra, scene_file: Path, option: str, value: float) -> None:
    outcome = here("quote", scene_file, option, value)
    assert outcome.code == 2
    assert option in outcome.err
