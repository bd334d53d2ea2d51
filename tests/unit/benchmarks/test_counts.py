"""More computed than is kept is a regression, more seconds are none."""

import json
from pathlib import Path

import pytest

import renderer
from accuracy.variations import fixed_quality
from benchmarks import counts
from scenes import scene_path


def plan(light_samples: int) -> renderer.RenderPlan:
    scene = renderer.load_scene(scene_path("study/soft")).document
    small = scene.model_copy(update={"camera": scene.camera.model_copy(update={"width": 16, "height": 16})})
    return renderer.compile_scene(small, fixed_quality("center", 1, "uniform", light_samples))


def run(light_samples: int, release: str = "2.4.6", unit: float = 1.0) -> counts.Run:
    return {"numpy": release, "pictures": {"room": counts.counts_of(plan(light_samples), unit)}}


def test_a_picture_is_counted_the_same_each_time_whatever_its_seconds() -> None:
    first, second = run(4, unit=1.0), run(4, unit=1e-6)
    assert counts.flat(first["pictures"]["room"]) == counts.flat(second["pictures"]["room"])
    assert counts.regressions(second, first) == []


def test_more_work_is_a_regression_and_less_is_none() -> None:
    little, much = run(4), run(16)
    assert any("shadow rays" in line for line in counts.regressions(much, little))
    assert counts.regressions(little, much) == []


@pytest.mark.parametrize(("release", "code"), [("2.4.9", 1), ("2.5.0", 0)])
def test_another_release_of_numpy_fails_nothing(
    release: str, code: int, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "counts.json").write_text(json.dumps(run(4)))
    monkeypatch.setattr(counts, "KEPT", tmp_path / "counts.json")
    monkeypatch.setattr(counts, "run", lambda: run(16, release))
    monkeypatch.setattr("sys.argv", ["counts"])
    assert counts.main() == code


def test_every_picture_is_kept() -> None:
    assert json.loads(counts.KEPT.read_text())["pictures"].keys() == counts.PICTURES.keys()
