from __future__ import annotations

import json
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from renderer.images.files import decode_exr
from schemas.api.layers import LAYER_NAMES
from tests.service.cli.conftest import CLEAN, Penumbra


@pytest.mark.slow
def test_layers_beside_picture_and_in_exr(here: Penumbra, scene_file: Path, tmp_path: Path) -> None:
    names = ",".join(LAYER_NAMES)
    assert here("render", scene_file, "-o", "a.npy", "--layers", names, "--workers", 1).code == 0
    assert here("render", scene_file, "-o", "b.exr", "--layers", names, "--workers", 2, "--tile", 9).code == 0
    image, layers = decode_exr((tmp_path / "b.exr").read_bytes())
    assert image.tobytes() == np.load(tmp_path / "a.npy").tobytes()
    for name in LAYER_NAMES:
        saved = (tmp_path / f"a.npy.{name}.npy").read_bytes()
        assert saved == (tmp_path / f"b.exr.{name}.npy").read_bytes()
        assert np.load(tmp_path / f"a.npy.{name}.npy").tobytes() == layers[name].tobytes()
    assert set(np.unique(layers["shape"])) == {-1, 0, 1}


def test_repeated_option_adds_layers(here: Penumbra, scene_file: Path, tmp_path: Path) -> None:
    words = ["--layers", "depth", "--layers", "shape,normal", "--workers", 1]
    assert here("render", scene_file, "-o", "OUT.EXR", *words).code == 0
    assert {path.name for path in tmp_path.iterdir()} == {
        *("scene.json", "OUT.EXR", "OUT.EXR.depth.npy", "OUT.EXR.normal.npy", "OUT.EXR.shape.npy")
    }
    assert list(decode_exr((tmp_path / "OUT.EXR").read_bytes())[1]) == ["depth", "normal", "shape"]


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (["render", "scene.json", "-o", "a.png", "--layers", "depth,nromal"], "'normal'"),
        (["render", "scene.json", "-o", "a.png", "--layers", "depth", "--layers", "nromal"], "'normal'"),
        (["explain", "scene.json", "--layers", "elephant"], "depth, position,"),
        (["submit", "scene.json", "-o", "a.png", "--layers", "Depth"], "'depth'"),
        (["get", "some", "-o", "a.png", "--layers", "uvw"], "'uv'"),
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
    assert [path.name for path in tmp_path.iterdir()] == ["scene.json"]


@pytest.mark.parametrize(
    "words", [["uv, depth"], ["uv", "--layers", "depth"], ["depth,uv", "--layers", "uv"]]
)
def test_plan_names_layers(here: Penumbra, scene_file: Path, words: list[str]) -> None:
    stages = here("explain", scene_file, "--layers", *words, "--json").document["stages"]
    named = [stage["name"] for stage in stages if stage["effect"].startswith("layers")]
    assert named == ["rays of layers", "layer depth", "layer uv"]


def test_missing_extra_is_refused_before_work(scene_file: Path, tmp_path: Path) -> None:
    """What an installation without the extra does: the import fails."""
    words = ["render", scene_file.name, "-o", "a.exr", "--json"]
    program = (
        "import sys; sys.modules['OpenEXR'] = None; from service.cli.main import main; main(sys.argv[1:])"
    )
    done = subprocess.run(
        [sys.executable, "-c", program, *words],
        capture_output=True,
        text=True,
        cwd=tmp_path,
        env=CLEAN | {"PYTHONPATH": str(Path(__file__).parents[3])},
        timeout=120,
        check=False,
    )
    assert done.returncode == 2
    assert "pip install 'penumbra-render[exr]'" in json.loads(done.stdout)["detail"]
    assert [path.name for path in tmp_path.iterdir()] == ["scene.json"]
