"""Options of several commands: quality, size and layers."""

import json
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from renderer.images.files import decode_exr
from schemas.api.layers import LAYER_NAMES
from service.cli.errors import CommandError
from service.cli.quality_options import QualityOptions
from tests.service.cli.conftest import Penumbra, ended


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"target_error": 0.1, "samples": 4}, r"Leave out --samples\.$"),
        ({"target_error": 0.1, "light_pattern": "sobol"}, r"Leave out --light-pattern\.$"),
        ({"time_limit": 3.0}, "Give --target-error too"),
        ({"confidence": 0.9}, "Give --target-error too"),
        ({"target_error": 0.0}, "^--target-error: "),
        ({"target_error": float("nan")}, "^--target-error: "),
        ({"target_error": 0.1, "time_limit": -1.0}, "^--time-limit: "),
        ({"target_error": 0.1, "confidence": 1.0}, "^--confidence: "),
    ],
)
def test_wrong_quality_names_its_option(changes: dict[str, Any], message: str) -> None:
    with pytest.raises(CommandError, match=message):
        QualityOptions(**changes).requested({})


def test_reached_error_in_the_report(here: Penumbra, scene_file: Path) -> None:
    outcome = here("render", scene_file, "-o", "a.npy", "--target-error", 0.05, "--workers", 1, "--json")
    error = outcome.document["error"]
    assert error["low"] <= error["estimate"] <= error["high"]


@pytest.mark.parametrize(
    ("options", "given", "edited"),
    [
        (["--width", 24], {}, {"width": 24, "height": 16}),
        (["--height", 8], {}, {"width": 12, "height": 8}),
        (["--width", 20, "--height", 30], {}, {"width": 20, "height": 30}),
        (["--scale", 2, "--crop", "8,4,16,10"], {}, {"width": 96, "height": 64, "crop": [8, 4, 16, 10]}),
        # The part is the same at half the size, to whole pixels around it.
        (["--scale", 0.5], {"crop": [5, 4, 16, 10]}, {"width": 24, "height": 16, "crop": [2, 2, 9, 5]}),
    ],
    ids=["width", "height", "both", "crop of a scaled picture", "scaled crop"],
)
def test_size_options_equal_an_edited_scene(
    here: Penumbra,
    scene: dict[str, Any],
    tmp_path: Path,
    options: list[object],
    given: dict[str, Any],
    edited: dict[str, Any],
) -> None:
    for name, camera in (("given", given), ("edited", edited)):
        document = scene | {"camera": scene["camera"] | camera}
        (tmp_path / f"{name}.json").write_text(json.dumps(document))
    assert here("render", "given.json", "-o", "a.npy", "--workers", 1, *options).code == 0
    assert here("render", "edited.json", "-o", "b.npy", "--workers", 1).code == 0
    assert (tmp_path / "a.npy").read_bytes() == (tmp_path / "b.npy").read_bytes()


@pytest.mark.parametrize(
    ("options", "message"),
    [
        (["--scale", 0.5, "--width", 10], "Leave out --width and --height"),
        (["--crop", "1,2,3,-4"], "--crop must be X,Y,WIDTH,HEIGHT"),
        (["--crop", "40,0,9,9"], "48 x 32 pixels"),
        (["--crop", "5,5,99999999999999999999,5"], "outside of any picture"),
        (["--width", 60000], "at most"),
        (["--height", 60000], "90000 x 60000 pixels"),
        (["--scale", 2000], "96000 x 64000 pixels"),
        (["--scale", "nan"], "must be at"),
    ],
)
def test_impossible_sizes_are_refused(
    here: Penumbra, scene_file: Path, options: list[object], message: str
) -> None:
    outcome = here("render", scene_file, "-o", "a.png", *options)
    assert outcome.code == 2
    assert message in outcome.err


def test_layers_beside_picture_and_in_exr(here: Penumbra, scene_file: Path, tmp_path: Path) -> None:
    all_but_one, last = LAYER_NAMES[:-1], LAYER_NAMES[-1]
    words = ["--layers", ",".join(all_but_one), "--layers", last, "--workers", 1]
    assert here("render", scene_file, "-o", "a.npy", *words).code == 0
    assert here("render", scene_file, "-o", "B.EXR", *words, "--tile", 9).code == 0
    image, layers = decode_exr((tmp_path / "B.EXR").read_bytes())
    assert image.tobytes() == np.load(tmp_path / "a.npy").tobytes()
    assert list(layers) == list(LAYER_NAMES)
    for name, values in layers.items():
        saved = (tmp_path / f"a.npy.{name}.npy").read_bytes()
        assert saved == (tmp_path / f"B.EXR.{name}.npy").read_bytes()
        assert np.load(tmp_path / f"a.npy.{name}.npy").tobytes() == values.tobytes()
    assert len(list(tmp_path.iterdir())) == 3 + 2 * len(LAYER_NAMES)


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (["render", "scene.json", "-o", "a.png", "--layers", "depth", "--layers", "nromal"], "'normal'"),
        (["explain", "scene.json", "--layers", "elephant"], "depth, position,"),
        (["submit", "scene.json", "-o", "a.png", "--layers", "Depth"], "'depth'"),
        (["get", "some", "--layers", "uv"], "-o"),
        (["render", "scene.json", "-o", "a.png", "--layers", ""], "layer ''"),
    ],
)
def test_unknown_layer_is_refused_before_work(
    here: Penumbra, scene_file: Path, tmp_path: Path, words: list[str], said: str
) -> None:
    outcome = here(*words)
    assert outcome.code == 2
    assert said in outcome.err
    assert list(tmp_path.iterdir()) == [scene_file]


def test_plan_names_layers_once(here: Penumbra, scene_file: Path) -> None:
    words = ("--layers", "depth, uv", "--layers", "uv", "--json")
    stages = here("explain", scene_file, *words).document["stages"]
    named = [stage["name"] for stage in stages if stage["effect"].startswith("layers")]
    assert named == ["rays of layers", "layer depth", "layer uv"]


@pytest.mark.parametrize(
    ("module", "extra", "words"),
    [("OpenEXR", "exr", ["render", "-o", "a.exr"]), ("matplotlib", "study", ["study", "--out", "out"])],
)
def test_missing_extra_is_refused_before_work(
    scene_file: Path, tmp_path: Path, module: str, extra: str, words: list[str]
) -> None:
    # As in an installation without the extra, the import fails.
    program = (
        f"import sys; sys.modules['{module}'] = None; from service.cli.main import main; main(sys.argv[1:])"
    )
    outcome = ended(tmp_path, *words, scene_file, "--json", program=[sys.executable, "-c", program])
    assert outcome.code == 2
    assert f"pip install 'penumbra-render[{extra}]'" in outcome.document["detail"]
    assert list(tmp_path.iterdir()) == [scene_file]
