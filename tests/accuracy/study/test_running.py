"""Studies of a tiny scene, run for real."""

import json
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

from accuracy.statistics import rms_difference
from accuracy.study import report
from accuracy.study.journal import JOURNAL
from accuracy.study.running import Forecast, Study
from renderer import compile_scene, render
from tests.accuracy.study.scenes import TINY, scene

Finished = tuple[Path, dict[str, Any]]


def lines(folder: Path) -> list[dict[str, Any]]:
    return [json.loads(line) for line in (folder / JOURNAL).read_text().splitlines()]


def timed_alike(folder: Path) -> set[str]:
    """Keys of all runs but the pictures at equal time: which those are depends on the clock."""
    return {line["key"] for line in lines(folder) if line["part"] != "picture"}


def silent(_: Forecast) -> None:
    """Report nothing."""


class Killed(BaseException):
    """Ends a study in the middle, as a signal does."""


def killed_after(runs: int, folder: Path) -> None:
    """Begin a study, and kill it when it begins a run after so many."""

    def interrupt(forecast: Forecast) -> None:
        if forecast.done >= runs:
            raise Killed

    with pytest.raises(Killed):
        Study(scene(), folder, TINY).run(interrupt)


@pytest.fixture(scope="module")
def finished(tmp_path_factory: pytest.TempPathFactory) -> Finished:
    """A folder with a whole study, and what it gave."""
    folder = tmp_path_factory.mktemp("study")
    return folder, Study(scene(), folder, TINY).run(silent)


def without_times(document: Mapping[str, Any]) -> list[Any]:
    """The results of a study without seconds, which differ between machines."""
    rows = [(row["name"], row["rmse_255"], row["rays"], row["hot"]) for row in document["settings"]]
    effects = sorted((row["effect"], row["difference_255"]) for row in document["effects"])
    return [rows, effects, document["reference"]["rmse_255"]]


def test_study_does_everything_that_was_planned(finished: Finished) -> None:
    folder, document = finished
    assert document["runs"]["done"] == document["runs"]["planned"]
    assert {row["runs"] for row in document["settings"]} == {TINY.seeds}
    assert (len(document["effects"]), len(document["precision"])) == (3, 2)
    assert document["size"]["ratio"] > 0
    before = lines(folder)
    again = Study(scene(), folder, TINY)
    assert (again.forecast().seconds, again.forecast().share) == (0, 1)
    assert without_times(again.run(silent)) == without_times(document)
    assert lines(folder) == before
    # Another scene in the same folder is studied anew.
    assert Study(scene(ambient=[1, 1, 0.5]), folder, TINY).forecast().done == 0
    assert Study(scene(name="renamed"), folder, TINY).forecast().done > 0


SLOW = [pytest.param(runs, marks=pytest.mark.slow) for runs in (0, 20)]


@pytest.mark.slow
@pytest.mark.parametrize("runs", [2, *SLOW])
def test_study_that_was_killed_renders_nothing_twice(tmp_path: Path, finished: Finished, runs: int) -> None:
    killed_after(runs, tmp_path)
    begun = lines(tmp_path) if runs else []
    assert len(begun) == runs
    document = Study(scene(), tmp_path, TINY).run(silent)
    keys = [line["key"] for line in lines(tmp_path)]
    assert lines(tmp_path)[:runs] == begun
    assert len(set(keys)) == len(keys)
    assert timed_alike(tmp_path) == timed_alike(finished[0])
    assert without_times(document) == without_times(finished[1])


@pytest.mark.slow
def test_forecast_counts_runs_and_ends_at_nothing(tmp_path: Path) -> None:
    """Settings of more seeds have intervals around their means."""
    seen: list[Forecast] = []
    document = Study(scene(), tmp_path, replace(TINY, seeds=3, errors_255=())).run(seen.append)
    counted = [one for one in seen if one.done < one.runs]
    assert [one.done for one in counted] == list(range(counted[0].runs))
    assert all(0 < one.share <= 1 for one in counted[1:])
    assert counted[0].share == 0
    assert counted[0].seconds > 0
    rows = {row["name"]: row["rmse_255"] for row in document["settings"]}
    noisy, plain = rows["random 4 x 1"], rows["uniform 4 x 1"]
    assert noisy["low"] < noisy["estimate"] < noisy["high"]
    # Seeds make no difference to it: what is left is what the reference does not know.
    assert plain["high"] - plain["low"] < noisy["high"] - noisy["low"]


def test_reference_is_as_good_as_the_time_allows(tmp_path: Path) -> None:
    """Without any time there is the coarsest and nothing else; a study that goes on keeps it."""
    short = Study(scene(), tmp_path, TINY, budget=1e-9)
    coarsest, best = (short.program.references(TINY.references[i])[0].key for i in (-1, 0))
    assert short.references[0].key == coarsest
    document = short.run(silent)
    assert document["runs"]["done"] == 2
    assert document["settings"] == document["pictures"] == []
    assert report.answered(document)["answers"]
    longer = Study(scene(), tmp_path, TINY)
    assert (longer.references[0].key, longer.forecast().done) == (coarsest, 2)
    assert Study(scene(), tmp_path / "new", TINY, budget=1e6).references[0].key == best


def test_difference_of_an_effect_is_that_of_two_pictures(finished: Finished) -> None:
    """The scene's own samples are few enough to be the study's."""
    folder, document = finished
    row = next(row for row in document["effects"] if row["effect"] == "light 0")
    whole = Study(scene(), folder, TINY).program.subject.scene.document
    dark = whole.model_copy(update={"lights": ()})
    images = [render(compile_scene(one)).image for one in (whole, dark)]
    assert row["difference_255"] == pytest.approx(255 * rms_difference(*images), rel=1e-12)


def test_picture_that_is_gone_is_rendered_again(tmp_path: Path) -> None:
    killed_after(2, tmp_path)
    next((tmp_path / "pictures").glob("*.npy")).unlink()
    killed_after(3, tmp_path)
    keys = [line["key"] for line in lines(tmp_path)]
    assert (len(keys), len(set(keys))) == (4, 3)
