"""Pictures of mistakes are rendered once for a class."""

from __future__ import annotations

from pathlib import Path

import numpy as np

import renderer
from service.grading.mistakes.counterfactuals import explain
from service.grading.mistakes.reproductions import kept
from tests.service.grading.test_counterfactuals import against, bulb, picture, scene

RED = np.full((2, 3, 3), (1, 0, 0), np.float32)


def test_a_kept_picture_is_not_rendered_again(tmp_path: Path) -> None:
    rendered = []

    def render() -> np.ndarray:
        rendered.append(1)
        return RED

    for _ in range(2):
        assert (kept(tmp_path, "red", render) == RED).all()
    assert len(rendered) == 1
    kept(tmp_path, "another", render)
    kept(None, "red", render)
    assert len(rendered) == 3


def test_the_next_submission_is_diagnosed_with_the_same_pictures(tmp_path: Path) -> None:
    loaded = renderer.load_scene(scene())
    found = against(picture(scene(), "uniform", "uniform", 144), picture(bulb()))
    alone = explain(loaded, found)
    assert [cause.cause for cause in alone] == ["hard_shadows"]
    assert explain(loaded, found, keep=tmp_path) == alone
    before = {file: file.stat().st_mtime_ns for file in tmp_path.iterdir()}
    assert len(before) > 3
    assert explain(loaded, found, keep=tmp_path) == alone
    assert {file: file.stat().st_mtime_ns for file in tmp_path.iterdir()} == before
