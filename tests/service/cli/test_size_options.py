"""Other sizes and parts of a picture by options: as if the scene had been edited."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import pytest

from tests.service.cli.conftest import Penumbra

EDITED: dict[str, tuple[list[object], dict[str, Any]]] = {
    "width": (["--width", 24], {"width": 24, "height": 16}),
    "height": (["--height", 8], {"width": 12, "height": 8}),
    "both": (["--width", 20, "--height", 30], {"width": 20, "height": 30}),
    "scale": (["--scale", 0.25], {"width": 12, "height": 8}),
    "crop": (["--crop", "8,4,16,10"], {"crop": [8, 4, 16, 10]}),
    "crop of a scaled picture": (
        ["--scale", 2, "--crop", "8,4,16,10"],
        {"width": 96, "height": 64, "crop": [8, 4, 16, 10]},
    ),
}


@pytest.mark.parametrize("case", EDITED)
def test_size_options_equal_an_edited_scene(
    here: Penumbra, scene: dict[str, Any], scene_file: Path, tmp_path: Path, case: str
) -> None:
    options, changes = EDITED[case]
    scene["camera"] |= changes
    (tmp_path / "edited.json").write_text(json.dumps(scene))
    assert here("render", scene_file, "-o", "a.png", "--workers", 1, *options).code == 0
    assert here("render", "edited.json", "-o", "b.png", "--workers", 1).code == 0
    assert (tmp_path / "a.png").read_bytes() == (tmp_path / "b.png").read_bytes()


def test_crop_is_scaled(here: Penumbra, scene: dict[str, Any], scene_file: Path, tmp_path: Path) -> None:
    """At half the size the part is the same, to whole pixels around it."""
    scene["camera"]["crop"] = [5, 4, 16, 10]
    scene_file.write_text(json.dumps(scene))
    scene["camera"] |= {"width": 24, "height": 16, "crop": [2, 2, 9, 5]}
    (tmp_path / "edited.json").write_text(json.dumps(scene))
    assert here("render", scene_file, "-o", "a.png", "--workers", 1, "--scale", 0.5).code == 0
    assert here("render", "edited.json", "-o", "b.png", "--workers", 1).code == 0
    assert (tmp_path / "a.png").read_bytes() == (tmp_path / "b.png").read_bytes()


@pytest.mark.parametrize(
    ("options", "message"),
    [
        (["--scale", 0.5, "--width", 10], "Leave out --width and --height"),
        (["--crop", "1,2,3"], "--crop must be X,Y,WIDTH,HEIGHT"),
        (["--crop", "1,2,3,-4"], "--crop must be X,Y,WIDTH,HEIGHT"),
        (["--crop", "40,0,9,9"], "48 x 32 pixels"),
        (["--width", 60000], "at most"),
        (["--height", 60000], "90000 x 60000 pixels"),
        (["--scale", 2000], "96000 x 64000 pixels"),
        (["--scale", "inf"], "at most"),
        (["--scale", "nan"], "must be at"),
        (["--crop", "5,5,99999999999999999999,5"], "outside of any picture"),
    ],
)
def test_impossible_sizes_are_refused(
    here: Penumbra, scene_file: Path, options: list[object], message: str
) -> None:
    outcome = here("render", scene_file, "-o", "a.png", *options)
    assert outcome.code == 2
    assert message in outcome.err
