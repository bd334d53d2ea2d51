from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from schemas.api.comparisons import ComparisonAnswer
from tests.service.cli.conftest import Penumbra


@pytest.fixture
def picture(tmp_path: Path) -> np.ndarray:
    """Codes of a picture without symmetry, saved as picture.png, and upside down as flipped.png."""
    codes = np.random.default_rng(4).integers(0, 200, (24, 32, 3)).cumsum(axis=0) // 24
    codes = codes.astype(np.uint8)
    Image.fromarray(codes).save(tmp_path / "picture.png")
    Image.fromarray(codes[::-1]).save(tmp_path / "flipped.png")
    return codes


def test_equal_pictures_match(penumbra: Penumbra, picture: np.ndarray) -> None:
    outcome = penumbra("compare", "picture.png", "picture.png")
    assert outcome.code == 0
    assert outcome.out.startswith("match: ")
    assert outcome.out.count("srgb (not stated") == 2
    assert outcome.err == ""


@pytest.mark.parametrize(("image", "code"), [("flipped.png", 1), ("picture.png", 0)])
def test_low_score_exit_code(here: Penumbra, picture: np.ndarray, image: str, code: int) -> None:
    assert here("compare", image, "picture.png", "--fail-under", "1").code == code


def test_json_document(here: Penumbra, picture: np.ndarray) -> None:
    outcome = here("compare", "flipped.png", "picture.png", "--json")
    found = ComparisonAnswer.model_validate(outcome.document)
    assert found.verdict == "mismatch"
    assert found.diagnosis[0].cause == "flipped_vertically"
    assert found.inputs.image.encoding == "srgb"
    assert set(outcome.document["timings"]) == {"seconds", "cpu_seconds"}
    assert set(outcome.document) - {"timings"} == {
        field.alias or name for name, field in ComparisonAnswer.model_fields.items()
    } - {"images"}


def test_stated_encoding(here: Penumbra, picture: np.ndarray) -> None:
    outcome = here("compare", "picture.png", "picture.png", "--encoding", "linear", "--json")
    assert outcome.document["inputs"]["image"]["encoding"] == "linear"
    assert outcome.document["inputs"]["image"]["encoding_stated"] is True
    assert outcome.document["inputs"]["reference"]["encoding_stated"] is False
    # The same codes, read as linear in one picture alone.
    assert outcome.document["metrics"]["rmse"] > 0.1


def test_difference_pictures(here: Penumbra, picture: np.ndarray, tmp_path: Path) -> None:
    words = ("--heat-map", "heat.png", "--side-by-side", "side.png")
    assert here("compare", "flipped.png", "picture.png", *words).code == 0
    sizes = []
    for name in ("heat.png", "side.png"):
        with Image.open(tmp_path / name) as saved:
            sizes.append(saved.size)
    assert sizes == [(32, 24), (3 * 32 + 8, 24)]


def test_worst_region_names_its_shape(here: Penumbra, scene_file: Path, tmp_path: Path) -> None:
    assert here("render", scene_file, "-o", "whole.npy").code == 0
    pixels = np.load(tmp_path / "whole.npy")
    # On the ball, which is in the middle of the picture and almost 6 pixels wide.
    pixels[14:18, 22:26] = 0.9
    np.save(tmp_path / "spoilt.npy", pixels)
    outcome = here("compare", "spoilt.npy", "whole.npy", "--scene", scene_file, "--json")
    assert outcome.document["worst_regions"][0]["name"] == "ellipsoid (shapes/1)"


def test_flip_on_request(here: Penumbra, picture: np.ndarray) -> None:
    asked = here("compare", "flipped.png", "picture.png", "--flip", "--json")
    assert 0 < asked.document["metrics"]["flip"] < 1
    assert here("compare", "flipped.png", "picture.png", "--json").document["metrics"]["flip"] is None


@pytest.mark.parametrize(
    ("words", "code", "found"),
    [
        (("picture.png", "none.png"), 3, "none.png"),
        (("picture.png", "small.npy"), 3, "32 x 24"),
        (("picture.png", "nan.npy"), 3, "column 3, row 2"),
        (("picture.png", "picture.png", "--encoding", "gamma"), 2, "gamma"),
        (("picture.png", "picture.png", "--heat-map", "heat.jpg"), 2, ".png"),
        (("picture.png", "picture.png", "--tolerance", "2"), 2, "tolerance"),
    ],
)
def test_unusable_arguments(
    here: Penumbra, picture: np.ndarray, tmp_path: Path, words: tuple[str, ...], code: int, found: str
) -> None:
    np.save(tmp_path / "small.npy", np.zeros((4, 4, 3), np.float32))
    bad = np.zeros((24, 32, 3), np.float32)
    bad[2, 3, 0] = np.nan
    np.save(tmp_path / "nan.npy", bad)
    outcome = here("compare", *words)
    assert outcome.code == code
    assert found in outcome.err
    assert outcome.out == ""
