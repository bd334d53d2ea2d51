from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from service.cli.errors import CommandError
from service.cli.quality_options import QualityOptions
from tests.service.cli.conftest import Penumbra


def test_target_error_with_its_options() -> None:
    options = QualityOptions(precision="double", target_error=0.01, confidence=0.8, time_limit=3.0)
    requested = options.requested({})
    assert requested is not None
    assert requested.model_dump() == {
        "mode": "target",
        "error": 0.01,
        "confidence": 0.8,
        "time_limit": 3.0,
        "precision": "double",
    }


@pytest.mark.parametrize(
    ("name", "value", "option"),
    [
        ("samples", 4, "--samples"),
        ("pattern", "sobol", "--pattern"),
        ("light_samples", 4, "--light-samples"),
        ("light_pattern", "sobol", "--light-pattern"),
    ],
)
def test_target_error_excludes_samples(name: str, value: object, option: str) -> None:
    with pytest.raises(CommandError, match=f"Leave out {option}\\.$"):
        QualityOptions(**{name: value}, target_error=0.01).requested({})


@pytest.mark.parametrize(("name", "value"), [("time_limit", 3.0), ("confidence", 0.9)])
def test_time_limit_needs_a_target_error(name: str, value: float) -> None:
    with pytest.raises(CommandError, match="Give --target-error too"):
        QualityOptions(**{name: value}).requested({})


@pytest.mark.parametrize(
    ("changes", "option"),
    [
        ({"target_error": 0.0}, "--target-error"),
        ({"target_error": float("nan")}, "--target-error"),
        ({"target_error": 0.1, "time_limit": -1.0}, "--time-limit"),
        ({"target_error": 0.1, "confidence": 0.4}, "--confidence"),
        ({"target_error": 0.1, "confidence": 1.0}, "--confidence"),
    ],
)
def test_invalid_numbers_name_their_option(changes: dict[str, float], option: str) -> None:
    with pytest.raises(CommandError, match=f"^{option}: "):
        QualityOptions(**changes).requested({})


def test_reached_error_in_the_report(here: Penumbra, scene_file: Path, tmp_path: Path) -> None:
    for name, options in {"a": ["--workers", 1], "b": ["--workers", 2, "--tile", 9, "--json"]}.items():
        outcome = here("render", scene_file, "-o", f"{name}.npy", "--target-error", 0.05, *options)
        assert outcome.code == 0
    error = outcome.document["error"]
    assert error["low"] <= error["estimate"] <= error["high"]
    assert np.load(tmp_path / "a.npy").tobytes() == np.load(tmp_path / "b.npy").tobytes()
