from __future__ import annotations

import io
import json
from pathlib import Path
from typing import Any

import pytest
from rich.console import Console

from schemas.api.plans import Offer, Pilot, PlanCost, Predicted, Quote
from schemas.quality import Antialiasing, FixedQuality, LightSampling, TargetQuality
from service.cli.quote import offers, options, short, unknown_errors
from tests.service.cli.conftest import Penumbra

SOBOL = FixedQuality(
    mode="fixed",
    antialiasing=Antialiasing(pattern="sobol", samples=16),
    light=LightSampling(pattern="sobol", samples=4),
    precision="double",
)
TARGET = TargetQuality(mode="target", error=0.004, time_limit=2.5)


@pytest.mark.slow
def test_json_document(penumbra: Penumbra, scene_file: Path) -> None:
    outcome = penumbra(
        "quote", scene_file, "--json", "--target-error", 0.02, "--time", 5, "--workers", 3, "--samples", 4,
        "--pattern", "sobol",
    )  # fmt: skip
    found = Quote.model_validate(outcome.document)
    assert found.workers == 3
    assert found.asked is not None
    assert isinstance(found.asked.quality, FixedQuality)
    assert found.asked.quality.antialiasing == Antialiasing(pattern="sobol", samples=4)
    assert found.for_error is not None
    assert found.for_seconds is not None


def test_offer_is_a_line_on_a_pipe(here: Penumbra, scene_file: Path) -> None:
    lines = [line.split("\t") for line in here("quote", scene_file, "--target-error", 0.02).out.splitlines()]
    kinds = [line[0] for line in lines]
    assert kinds.count("asked") == kinds.count("for error") == 1
    assert kinds.count("for time") == 0
    offers = {line[1]: line[2:] for line in lines if line[0] == "offer"}
    asked = next(line for line in lines if line[0] == "asked")
    assert offers[asked[1]] == asked[2:]
    seconds, cpu_seconds = (tuple(map(float, cell.split())) for cell in asked[2:4])
    assert seconds[1] <= seconds[0] <= seconds[2]
    assert seconds[0] <= cpu_seconds[0]


def test_unreachable_time_is_answered(here: Penumbra, scene: dict[str, Any], scene_file: Path) -> None:
    scene["camera"] |= {"width": 256, "height": 256}
    scene_file.write_text(json.dumps(scene))
    # Whether an error can be reached depends on how far pilot samples come; a picture takes a millisecond.
    outcome = here("quote", scene_file, "--target-error", 0.02, "--time", 0.001)
    lines = [line.split("\t") for line in outcome.out.splitlines()]
    assert ["for time", "nothing that was tried", "", "", ""] in lines
    assert [line[0] for line in lines].count("for error") == 1


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
)
def test_options_of_an_offer(quality: FixedQuality | TargetQuality, command: str) -> None:
    assert options(quality) == command


@pytest.mark.parametrize("columns", [80, 120])
def test_offer_is_a_row_on_a_terminal(here: Penumbra, scene_file: Path, columns: int) -> None:
    found = Quote.model_validate(here("quote", scene_file, "--json").document)
    console = Console(width=columns, file=io.StringIO())
    with console.capture() as shown:
        console.print(offers(found))
    rows = [line.split("  ")[1].strip() for line in shown.get().splitlines() if " (" in line]
    assert rows == [short(offer.quality) for offer in found.offers]
    assert "target 4/255" in rows


@pytest.mark.parametrize(
    ("option", "value"), [("--target-error", 0), ("--target-error", 2), ("--time", 0), ("--workers", 0)]
)
def test_invalid_options(here: Penumbra, scene_file: Path, option: str, value: float) -> None:
    outcome = here("quote", scene_file, option, value)
    assert outcome.code == 2
    assert option in outcome.err


def test_unknown_error_gives_its_reason_once() -> None:
    reason = "Only 96 pixels were sampled, too few to estimate an error: edges may lie between them."
    second = Predicted(estimate=1.0, low=0.5, high=2.0)
    offer = Offer(quality=SOBOL, cpu_seconds=second, seconds=second, error_unknown=reason)
    found = Quote(
        asked=offer,
        offers=(offer, offer),
        effects=(),
        price=PlanCost(camera_rays=1, shadow_rays=1, cpu_seconds=1.0),
        workers=1,
        pilot=Pilot(seconds=1.5, blocks=3, pixels=96, target_errors=0),
    )
    assert unknown_errors(found) == [reason]
