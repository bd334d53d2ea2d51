"""Renderers are compared by the cheapest setting that comes near enough."""

import json
import runpy
from pathlib import Path

import pytest

from benchmarks import peers_tables, references
from benchmarks.peers_runs import Run
from benchmarks.peers_settings import PENUMBRA, SCENES, TARGETS_255, label
from schemas.reading import read_scene

DOCS = Path(__file__).parents[3] / "docs"


def run(renderer: str, setting: str, seconds: float, error: float) -> Run:
    return Run(
        renderer=renderer,
        setting=setting,
        cpu_seconds=seconds,
        rmse_255=error,
        mean_difference_255=0.0,
    )


QUICK = run("Mitsuba", "quick", 1.0, 2.0)
WASTEFUL = run("Mitsuba", "wasteful", 3.0, 2.5)
FINE = run("Mitsuba", "fine", 4.0, 0.5)
OURS = run("Penumbra", "ours", 6.0, 1.0)
RUNS = [FINE, WASTEFUL, OURS, QUICK]


@pytest.mark.parametrize(
    ("target", "setting"), [(2.5, "quick"), (2.0, "quick"), (1.99, "fine"), (0.5, "fine"), (0.49, None)]
)
def test_the_cheapest_setting_within_an_error_is_chosen(target: float, setting: str | None) -> None:
    found = peers_tables.cheapest(RUNS, "Mitsuba", target)
    assert (found and found["setting"]) == setting


def test_a_setting_counts_for_the_front_where_no_cheaper_one_is_nearer() -> None:
    assert peers_tables.front([QUICK, WASTEFUL, FINE]) == [QUICK, FINE]


def test_a_row_tells_how_many_times_the_seconds_of_each_peer_ours_are() -> None:
    rows = {row[1]: row for row in peers_tables.ratio_rows({"room": RUNS})}
    assert list(rows) == ["1/64", "1/128", "1/255", "0.5/255", "0.25/255"]
    assert rows["1/255"] == ("room", "1/255", "4.00", "-", "6.00", "1.50", "-")
    assert rows["0.25/255"] == ("room", "0.25/255", "-", "-", "-", "-", "-")


def test_every_setting_has_a_name_of_its_own() -> None:
    names = [label(quality) for qualities in PENUMBRA for quality in qualities]
    assert len(set(names)) == len(names)


@pytest.mark.parametrize("name", SCENES)
def test_every_compared_scene_is_512_x_512_and_has_a_reference_near_enough_to_judge(name: str) -> None:
    """Errors add in squares: a reference 4 times nearer than the smallest target changes it by 3 %."""
    camera = read_scene(references.PATHS[name].read_bytes())[0].camera
    image, provenance = references.load(name)
    assert (camera.height, camera.width, 3) == image.shape == (512, 512, 3)
    assert provenance.own_error_255 < min(TARGETS_255) / 4


def test_the_page_tells_the_figures_that_are_kept_beside_it() -> None:
    generator = runpy.run_path(str(DOCS / "generate_performance_page.py"))
    measured = json.loads((DOCS / "figures" / "peers.json").read_text())
    page = (DOCS / "performance.md").read_text()
    assert generator["page"](measured) == page, "run python docs/generate_performance_page.py"
