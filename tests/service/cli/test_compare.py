import re
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from renderer.images.files import encode_exr
from schemas.api.comparisons import ComparisonAnswer
from tests.service.cli.conftest import ENVIRONMENT, Penumbra

pytestmark = pytest.mark.usefixtures("pictures")


LARGE, MOST_MIB = (2160, 3840), 400
"""Rows and columns, and memory for them: two pictures of 95 MiB in single precision, the program with 85, and
some rows at a time of a drawing of 25 million pixels."""
# Not `ru_maxrss`: a process begins with the peak of the one that started it.
MEASURED = """
import atexit, runpy, sys
from pathlib import Path
atexit.register(lambda: sys.stderr.write(Path("/proc/self/status").read_text()))
runpy.run_module("service.cli.main", run_name="__main__", alter_sys=True)
"""


@pytest.fixture
def pictures(tmp_path: Path) -> None:
    """One without symmetry, the same upside down, one of another size, and one with a number that is none."""
    codes = np.random.default_rng(4).integers(0, 200, (24, 32, 3)).cumsum(axis=0) // 24
    codes = codes.astype(np.uint8)
    Image.fromarray(codes).save(tmp_path / "picture.png")
    Image.fromarray(codes[::-1]).save(tmp_path / "flipped.png")
    (tmp_path / "torn.png").write_bytes((tmp_path / "picture.png").read_bytes()[:60])
    np.save(tmp_path / "small.npy", np.zeros((4, 4, 3), np.float32))
    broken = np.zeros((24, 32, 3), np.float32)
    broken[2, 3, 0] = np.nan
    np.save(tmp_path / "nan.npy", broken)


def test_equal_pictures_match(here: Penumbra) -> None:
    outcome = here("compare", "picture.png", "picture.png", "--fail-under", "1")
    assert (outcome.code, outcome.err) == (0, "")
    assert outcome.out.startswith("match: ")


def test_mismatch_with_its_pictures(here: Penumbra, tmp_path: Path) -> None:
    words = ("--flip", "--json", "--heat-map", "heat.png", "--side-by-side", "side.png")
    outcome = here("compare", "flipped.png", "picture.png", *words, "--fail-under", "1")
    assert outcome.code == 1
    found = ComparisonAnswer.model_validate(outcome.document)
    assert (found.verdict, found.diagnosis[0].cause) == ("mismatch", "flipped_vertically")
    assert 0 < outcome.document["metrics"]["flip"] < 1
    assert set(outcome.document["timings"]) == {"seconds", "cpu_seconds"}
    sizes = []
    for name in ("heat.png", "side.png"):
        with Image.open(tmp_path / name) as saved:
            sizes.append(saved.size)
    assert sizes == [(32, 24), (3 * 32 + 8, 24)]


def test_stated_encoding(here: Penumbra) -> None:
    found = here("compare", "picture.png", "picture.png", "--encoding", "linear", "--json").document
    assert (found["inputs"]["image"]["encoding"], found["inputs"]["image"]["encoding_stated"]) == (
        "linear",
        True,
    )
    assert found["inputs"]["reference"]["encoding_stated"] is False
    # The same codes, read as linear in one picture alone.
    assert found["metrics"]["rmse"] > 0.1
    assert found["metrics"]["flip"] is None


def test_worst_region_names_its_shape(here: Penumbra, scene_file: Path, tmp_path: Path) -> None:
    assert here("render", scene_file, "-o", "whole.npy", "--workers", 1).code == 0
    pixels = np.load(tmp_path / "whole.npy")
    # On the ball, which is in the middle of the picture.
    pixels[12:16, 22:26] = 0.9
    np.save(tmp_path / "spoilt.npy", pixels)
    outcome = here("compare", "spoilt.npy", "whole.npy", "--scene", scene_file, "--json")
    assert outcome.document["worst_regions"][0]["name"] == "ellipsoid (shapes/1)"


@pytest.mark.parametrize(
    ("words", "code", "found"),
    [
        (("picture.png", "none.png"), 3, "none.png"),
        (("torn.png", "picture.png"), 3, "damaged"),
        # Its size is known before it is decoded.
        (("torn.png", "small.npy"), 3, "32 x 24 pixels, not 4 x 4"),
        (("picture.png", "nan.npy"), 3, "column 3, row 2"),
        (("picture.png", "picture.png", "--encoding", "gamma"), 2, "gamma"),
        (("picture.png", "picture.png", "--heat-map", "heat.jpg"), 2, ".png"),
        (("picture.png", "picture.png", "--tolerance", "2"), 2, "tolerance"),
    ],
)
def test_unusable_arguments(here: Penumbra, words: tuple[str, ...], code: int, found: str) -> None:
    outcome = here("compare", *words)
    assert (outcome.code, outcome.out) == (code, "")
    assert found in outcome.err


@pytest.mark.parametrize(("package", "words"), [("flip_evaluator", ("--flip",)), ("OpenEXR", ())])
def test_missing_extra_is_wrong_usage(
    here: Penumbra, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, package: str, words: tuple[str, ...]
) -> None:
    (tmp_path / "picture.exr").write_bytes(encode_exr(np.zeros((24, 32, 3), np.float32)))
    monkeypatch.setitem(sys.modules, package, None)
    outcome = here("compare", "picture.png" if words else "picture.exr", "picture.png", *words)
    assert (outcome.code, outcome.out) == (2, "")
    assert "pip install" in outcome.err


@pytest.mark.slow
def test_large_pictures_take_little_memory(tmp_path: Path) -> None:
    ramp = np.linspace(0, 1, LARGE[1], dtype=np.float32)
    picture = np.broadcast_to(ramp[:, None], (*LARGE, 3))
    np.savez(tmp_path / "large.npz", image=picture)
    # Layers that no comparison reads would take 190 MiB more.
    (tmp_path / "large.exr").write_bytes(encode_exr(picture, {"normal": picture, "albedo": picture}))
    words = ("compare", "large.npz", "large.exr", "--side-by-side", "side.png")
    command = [sys.executable, "-c", MEASURED, *words]
    done = subprocess.run(command, cwd=tmp_path, env=ENVIRONMENT, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    assert int(re.findall(r"VmHWM:\s+(\d+) kB", done.stderr)[-1]) / 1024 < MOST_MIB
