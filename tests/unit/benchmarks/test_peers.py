"""Renderers are compared at equal true errors, and the kept comparison is that of the kept runs."""

import numpy as np
import pytest

from accuracy.variations import label
from benchmarks import peers_sentences, peers_tables, references
from benchmarks.peers_comparison import Comparison, comparisons, needed_samples, precisions
from benchmarks.peers_curves import front, seconds_at
from benchmarks.peers_runs import OURS, OURS_FIXED, PEER, Run
from benchmarks.peers_settings import ERRORS_255, FIXED, GOALS, KINDS, MITSUBA, SCENES, asked
from schemas.reading import read_scene
from tools.docs import figures


def run(renderer: str, seconds: float, error: float, asked_255: float | None = None) -> Run:
    return Run(
        renderer=renderer,
        setting=f"{seconds} s",
        asked_255=asked_255,
        cpu_seconds=seconds,
        rmse_255=error,
        mean_difference_255=0.0,
    )


QUICK, WASTEFUL, FINE = run(PEER, 1.0, 4.0), run(PEER, 3.0, 5.0), run(PEER, 4.0, 1.0)
RUNS = [
    FINE,
    WASTEFUL,
    QUICK,
    run(OURS, 1.0, 3.0, asked_255=4.0),
    run(OURS, 4.0, 0.75, asked_255=1.0),
    run(OURS_FIXED, 3.0, 0.75),
]


def compared(error: float, runs: list[Run] = RUNS, scene: str = "soft") -> Comparison:
    (found,) = comparisons({scene: runs}, [error])
    return found


def test_a_setting_counts_for_the_front_where_no_cheaper_one_is_nearer() -> None:
    assert front([FINE, WASTEFUL, QUICK]) == [QUICK, FINE]


@pytest.mark.parametrize(
    ("error", "seconds"),
    [
        pytest.param(9.0, 1.0, id="coarser than the coarsest: the cheapest run"),
        pytest.param(4.0, 1.0, id="the coarsest run"),
        pytest.param(2.0, 2.0, id="half way in logarithms, whatever the wasteful run says"),
        pytest.param(1.0, 4.0, id="the finest run"),
        pytest.param(0.999, None, id="finer than the finest: not reached"),
    ],
)
def test_seconds_are_interpolated_in_logarithms_along_the_front(error: float, seconds: float | None) -> None:
    found = seconds_at([FINE, WASTEFUL, QUICK], error)
    assert found == (None if seconds is None else pytest.approx(seconds))


def test_a_renderer_that_did_not_run_reaches_nothing() -> None:
    assert seconds_at([], 4.0) is None


def test_an_error_too_small_to_measure_costs_what_its_run_costs() -> None:
    assert seconds_at([QUICK, run(PEER, 5.0, 0.0)], 0.1) == 5.0


def test_a_comparison_has_interpolated_seconds_beside_those_of_a_requested_error() -> None:
    found = compared(1.0)
    assert found["seconds"][PEER] == 4.0
    assert found["seconds"][OURS] == pytest.approx(4.0 ** (np.log(3) / np.log(4)), abs=5e-4)
    assert found["over_peer"] == pytest.approx(4.0 ** (np.log(3) / np.log(4)) / 4, abs=5e-4)
    assert found["goal"] == dict(zip(ERRORS_255, GOALS["shapes"], strict=True))[1.0]
    assert found["asked"] == {"cpu_seconds": 4.0, "rmse_255": 0.75, "over_peer": 1.0}


def test_target_quality_is_compared_with_the_best_fixed_samples() -> None:
    assert compared(0.75)["over_fixed"] == pytest.approx(4 / 3, abs=5e-4)
    assert "soft at 0.75/255 1.33" in peers_sentences.of_fixed([compared(0.75)])
    assert "1 of the 1 rows" in peers_sentences.of_fixed([compared(4.0)])


def test_a_row_shows_a_dash_for_what_is_not_reached() -> None:
    assert peers_tables.equal_row(compared(0.5)) == ("soft", "0.5/255", "-", "-", "-", "-", "0.35")
    assert peers_tables.asked_row(compared(0.5)) == ("soft", "0.5/255", "-", "-", "-", "-")


def test_the_ratio_farthest_above_its_goal_is_named_in_words() -> None:
    rows = [compared(error) for error in (4.0, 2.0, 1.0, 0.5)]
    rows[1]["over_peer"] = 0.81
    (sentence,) = peers_sentences.of_goals(rows)
    assert "(soft): 1 of 3" in sentence
    assert sentence.endswith("the worst is soft at 1/255 0.75 (goal 0.5).")


def test_an_error_that_only_the_peer_reaches_is_worse_than_the_goal() -> None:
    row = compared(1.0, [QUICK, FINE, run(OURS, 1.0, 3.0, asked_255=4.0)])
    (sentence,) = peers_sentences.of_goals([row])
    assert "0 of 1" in sentence
    assert "soft at 1/255 not reached (goal 0.5)" in sentence


def test_a_kind_of_scene_that_keeps_its_goals_is_said_to() -> None:
    (sentence,) = peers_sentences.of_goals([compared(4.0)])
    assert "(soft): 1 of 1" in sentence
    assert "worst" not in sentence


def test_targets_that_cost_no_more_than_any_picture_do_not_count_for_precision() -> None:
    runs = [run(OURS, 1.0, 0.5, 8.0), run(OURS, 1.09, 0.5, 4.0), run(OURS, 2.0, 0.75, 1.0), QUICK]
    assert needed_samples(runs) == [(1.0, 0.75)]
    (found,) = precisions({"soft": runs, "chess": [QUICK]})
    assert found == {"scene": "soft", "targets": 1, "kept": 1, "least": 0.75, "median": 0.75, "most": 0.75}


def test_a_scene_that_misses_the_precision_is_named() -> None:
    (found,) = precisions({"soft": [run(OURS, 1.0, 0.5, 8.0), run(OURS, 2.0, 0.6, 1.0)]})
    assert peers_sentences.of_precision([found]).endswith("soft 0.60.")


def test_readme_gives_fine_and_coarse_errors_apart_and_counts_those_not_reached() -> None:
    slow = [QUICK, FINE, run(OURS, 9.0, 2.0, asked_255=2.0)]
    rows = [*(compared(error) for error in (4.0, 1.0)), *(compared(e, slow, "shell") for e in (4.0, 1.0))]
    sentence = peers_sentences.of_readme(rows)
    fine, coarse = sentence.split("from 4/255")
    assert "takes 0.75 times the CPU seconds" in fine
    assert "(not reached in 1 of 2 comparisons)" in fine
    assert coarse.endswith(" 1 to 9 times.")


def test_every_setting_has_a_name_of_its_own() -> None:
    names = [label(quality) for qualities in (asked(ERRORS_255), *FIXED) for quality in qualities]
    assert len(set(names)) == len(names)


def test_every_error_is_requested() -> None:
    asked_255 = [round(255 * quality.error, 4) for quality in asked(ERRORS_255)]
    assert set(ERRORS_255) <= set(asked_255)
    assert asked_255 == sorted(asked_255, reverse=True)


def test_every_kind_of_scene_has_a_goal_at_every_error() -> None:
    assert set(SCENES.values()) == set(KINDS) == set(GOALS)
    assert {len(goals) for goals in GOALS.values()} == {len(ERRORS_255)}


@pytest.mark.parametrize("name", SCENES)
def test_every_compared_scene_is_512_x_512_and_has_a_reference_near_enough_to_judge(name: str) -> None:
    """The reference's own error is subtracted in squares: it has to be the smaller part of the sum."""
    camera = read_scene(references.PATHS[name].read_bytes())[0].camera
    image, provenance = references.load(name)
    assert (camera.height, camera.width, 3) == image.shape == (512, 512, 3)
    assert provenance.own_error_255**2 < min(ERRORS_255) ** 2 / 2


@pytest.mark.peer
def test_the_peer_renders_exactly_the_numbers_of_samples_that_are_compared() -> None:
    peer = pytest.importorskip(
        "benchmarks.peer_pictures", reason="needs the extra `bench` and LLVM", exc_type=ImportError
    )
    assert [peer.sampler(samples).sample_count() for samples in MITSUBA] == [*MITSUBA]
    with pytest.raises(ValueError, match="132 samples in place of 128"):
        peer.sampler(128)


def test_the_comparison_is_what_the_kept_runs_come_to() -> None:
    measured = figures.read("peers")
    assert [*measured["scenes"]] == [*measured["references"]] == [*SCENES]
    assert measured["comparisons"] == comparisons(measured["scenes"], measured["errors_255"])
    assert measured["precisions"] == precisions(measured["scenes"])
