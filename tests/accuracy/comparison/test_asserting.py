import io
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from PIL import Image

from accuracy.comparison import NotComparableError, Picture, assert_render_close, compare
from accuracy.comparison.asserting import sentences
from renderer.images.colors import linear_from_srgb
from renderer.results import RenderResult

SIDE = 64
PICTURES = ("actual", "reference", "difference", "heat")


@pytest.fixture
def ramp() -> np.ndarray:
    """Dark at the top, bright at the bottom, in float64."""
    rows = np.linspace(0.1, 0.9, SIDE)
    return np.repeat(np.repeat(rows[:, None, None], SIDE, axis=1), 3, axis=2)


def test_equal_pictures_match_and_leave_no_folder(ramp: np.ndarray, tmp_path: Path) -> None:
    assert assert_render_close(ramp, ramp, folder=tmp_path / "none").judgement.verdict == "match"
    assert not (tmp_path / "none").exists()


def test_message_gives_verdict_cause_place_and_files(ramp: np.ndarray, tmp_path: Path) -> None:
    with pytest.raises(AssertionError) as caught:
        assert_render_close(ramp[::-1], ramp, folder=tmp_path)
    message = str(caught.value)
    for part in ("actual does not show what reference shows: mismatch", "flipped_vertically", "margin: -"):
        assert part in message
    assert "where: columns 0 to 63" in message
    assert f"pictures: actual.png, reference.png, difference.png, heat.png in {tmp_path}" in message
    assert {path.name for path in tmp_path.iterdir()} == {f"{name}.png" for name in PICTURES}


def test_message_says_what_cannot_be_undone() -> None:
    """A picture of 64 colours beside a reference of 4096, which states its noise."""
    y, x = np.mgrid[0:64, 0:64] / 64
    right = np.stack((x, y, np.zeros_like(x)), axis=2)
    layers = {"error": np.full(right.shape, 0.001), "samples": np.full(x.shape, 16)}
    reference = replace(Picture.of_values(right), layers=layers)
    message = " ".join(sentences(compare(Picture.of_values(np.floor(8 * right) / 8), reference)))
    assert "palette (RMSE" in message
    assert "cannot be undone" in message


def test_tolerance_may_allow_what_differs(ramp: np.ndarray) -> None:
    patched = ramp.copy()
    patched[24:40, 24:40] += 0.02  # 4 of 64 blocks
    with pytest.raises(AssertionError, match=r"6\.2 % of the blocks"):
        assert_render_close(patched, ramp)
    assert assert_render_close(patched, ramp, tolerance=0.03).bias.share == 0
    assert assert_render_close(patched, ramp, max_bias=0.07).bias.share == 4 / 64


def test_saved_pictures_show_what_their_names_say(tmp_path: Path) -> None:
    here, there = (
        np.full((SIDE, SIDE, 3), linear_from_srgb(np.array(seen)).astype(np.float64)) for seen in (0.6, 0.5)
    )
    with pytest.raises(AssertionError):
        assert_render_close(here, there, folder=tmp_path)
    codes = {name: np.asarray(Image.open(tmp_path / f"{name}.png")) for name in PICTURES}
    assert {found.shape for found in codes.values()} == {(SIDE, SIDE, 3)}
    assert (codes["actual"] == 153).all()
    assert (codes["reference"] == 128).all()
    # A tenth of the range, where a quarter is shown at full strength.
    assert (codes["difference"] == 102).all()


def png(codes: np.ndarray) -> bytes:
    buffer = io.BytesIO()
    Image.fromarray(codes).save(buffer, format="PNG")
    return buffer.getvalue()


def test_picture_may_be_file_bytes_array_image_or_result(tmp_path: Path) -> None:
    codes = np.random.default_rng(2).integers(0, 256, (SIDE, SIDE, 3), dtype=np.uint8)
    linear = linear_from_srgb(codes / 255).astype(np.float32)
    (tmp_path / "a.png").write_bytes(png(codes))
    forms: list[Any] = [
        tmp_path / "a.png",
        str(tmp_path / "a.png"),
        png(codes),
        Image.fromarray(codes),
        linear,
        RenderResult(image=linear, report={}, layers={}),
    ]
    for form in forms:
        assert assert_render_close(form, codes, reference_encoding="srgb").judgement.verdict == "match"


def test_sizes_that_differ_are_no_difference(ramp: np.ndarray) -> None:
    with pytest.raises(NotComparableError, match="State the encoding"):
        assert_render_close(np.zeros((8, 8, 3), np.uint8), ramp)
    with pytest.raises(NotComparableError, match="pixels, not"):
        assert_render_close(ramp[:8], ramp)
    with pytest.raises(TypeError, match="not object"):
        assert_render_close(object(), ramp)


def test_folder_is_a_new_one_by_default(
    ramp: np.ndarray, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("tempfile.tempdir", str(tmp_path))
    for count in (1, 2):
        with pytest.raises(AssertionError, match=str(tmp_path)):
            assert_render_close(ramp[::-1], ramp)
        assert len(list(tmp_path.glob("penumbra-*/heat.png"))) == count
