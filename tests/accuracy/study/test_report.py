"""The report of a tiny study, read back."""

from __future__ import annotations

import json
import re
from html.parser import HTMLParser
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

import pytest

from accuracy.study import answers, figures, pages, report
from accuracy.study.curves import rays, seconds
from accuracy.study.pages import Heading, Strip, Table
from accuracy.study.running import Study
from tests.accuracy.study.scenes import SCENE, TINY, scene

Found = tuple[dict[str, Any], dict[str, bytes]]


@pytest.fixture(scope="module")
def found(tmp_path_factory: pytest.TempPathFactory) -> Found:
    """The results and the files of a study."""
    study = Study(scene(), tmp_path_factory.mktemp("study"), TINY)
    results = report.answered(study.run(lambda _: None))
    return results, report.files(study, results)


class Reader(HTMLParser):
    """Collects what a page loads, what it shows as text, and elements left open."""

    VOID = frozenset({"meta", "img"})

    def __init__(self) -> None:
        super().__init__()
        self.loads: list[str] = []
        self.tags: list[str] = []
        self.open: list[str] = []
        self.text = ""

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self.tags.append(tag)
        self.loads += [value or "" for name, value in attrs if name in {"src", "href", "srcset", "data"}]
        if tag not in self.VOID:
            self.open.append(tag)

    def handle_endtag(self, tag: str) -> None:
        assert self.open.pop() == tag

    def handle_data(self, data: str) -> None:
        self.text += data


@pytest.fixture(scope="module")
def read(found: Found) -> Reader:
    """The page, read."""
    reader = Reader()
    reader.feed(found[1]["report.html"].decode())
    return reader


def test_the_page_loads_nothing_from_anywhere(read: Reader) -> None:
    assert read.loads
    assert [one for one in read.loads if not one.startswith(("data:image/png;base64,", "#"))] == []
    assert not {"script", "link", "iframe", "object"} & set(read.tags)
    assert read.open == []


def test_names_of_a_scene_are_shown_and_not_obeyed(read: Reader, found: Found) -> None:
    assert SCENE["name"] in read.text
    assert "b" not in read.tags
    assert r"small & \<b\>bold\</b\>" in found[1]["report.md"].decode()


def test_the_report_begins_with_the_answers(found: Found) -> None:
    results, files = found
    for name in ("report.md", "report.html"):
        text = files[name].decode()
        places = [text.index(row["question"]) for row in results["answers"]]
        assert places == sorted(places)
        assert max(places) < text.index("Error against seconds")


def test_no_curve_is_drawn_without_the_error_of_its_reference(found: Found) -> None:
    results, files = found
    drawn = [content.decode() for name, content in files.items() if name.endswith(".svg")]
    assert len(drawn) == 4
    label = f"error of the reference itself, {report.error(results['reference']['rmse_255'])}"
    assert [svg for svg in drawn if label not in svg] == []


def test_plots_are_whole_documents_and_the_same_for_the_same_results(found: Found) -> None:
    results, files = found
    svg = figures.error_against(results, seconds, "seconds")
    assert svg.encode() == files["images/seconds.svg"]
    ElementTree.fromstring(svg)  # noqa: S314 - we drew it ourselves
    assert svg != figures.error_against(results, rays, "rays")


def test_every_image_of_the_text_report_is_there(found: Found) -> None:
    _, files = found
    named = re.findall(r"\]\(([^)]+)\)", files["report.md"].decode())
    assert len(named) > 10
    assert set(named) == {name for name in files if name.startswith("images/")}


def test_results_are_json_that_comes_back(found: Found) -> None:
    results, files = found
    assert json.loads(files["results.json"]) == results


def test_settings_that_are_beaten_are_grey(found: Found, read: Reader) -> None:
    results, files = found
    beaten = sum(not row["front"] for row in results["settings"])
    assert beaten
    assert files["report.html"].decode().count('<tr class="grey">') == beaten


def test_a_report_of_no_runs_says_so(tmp_path: Path) -> None:
    study = Study(scene(), tmp_path, TINY, budget=1e-9)
    results = report.answered(study.run(lambda _: None))
    assert "images/front.svg" in report.files(study, results)
    assert results["effects"] == []
    assert all(row["answer"] for row in results["answers"])


def test_a_scene_without_anything_has_a_report_too(tmp_path: Path) -> None:
    """Nothing in it has an error: no curve has a point, and the reference is exact."""
    study = Study(scene(shapes=[], lights=[]), tmp_path, TINY)
    results = report.answered(study.run(lambda _: None))
    assert results["reference"]["rmse_255"] == 0
    assert not any(row["resolved"] for row in results["settings"])
    svg = report.files(study, results)["images/seconds.svg"].decode()
    assert "error of the reference itself, 0/255" in svg


def test_what_a_stranger_wrote_is_no_markup_in_a_table() -> None:
    table = Table(("a",), [("<img src=x>|`",)])
    assert "&lt;img src=x&gt;|`" in pages.html("title", [table])
    assert r"\<img src=x\>\|\`" in pages.markdown([table])


def test_pictures_that_do_not_fill_a_line_leave_cells_empty() -> None:
    strip = Strip("below", [(f"{n}.png", b"", str(n)) for n in range(4)])
    lines = pages.markdown([Heading("title", 1), strip]).splitlines()
    assert {line.count("|") for line in lines if line.startswith("|")} == {4}
    assert "| ![3](images/3.png) |  |  |" in lines


def setting(name: str, method: str, spent: float, off: float) -> dict[str, Any]:
    values = {"cpu_seconds": spent, "rmse_255": off}
    intervals = {key: {"estimate": value, "low": value, "high": value} for key, value in values.items()}
    return {"name": name, "method": method, "resolved": True, "rays": 1, **intervals}


MADE: dict[str, Any] = {
    "width": 100,
    "height": 100,
    "own_width": 200,
    "own_height": 200,
    "size": {"ratio": 4.0},
    "settings": [setting("sobol 4 x 4", "sobol", 1.0, 3.0), setting("sobol 16 x 4", "sobol", 4.0, 0.75)],
    "methods": [{"method": "sobol", "order": {"estimate": -1.0, "low": -1.5, "high": -0.5}}],
    "equal_error": [
        {"rmse_255": 4.0, "cpu_seconds": {"sobol": 1.0, "random": 2.0}},
        {"rmse_255": 2.0, "cpu_seconds": {"sobol": 1.5, "random": 6.0, "target": 0.5}},
        {"rmse_255": 1.0, "cpu_seconds": {"sobol": 3.0}},
    ],
    "effects": [
        {"effect": "antialiasing", "cpu_seconds": {"estimate": 9.0}, "share": 0.9, "pointers": ["/sampling"],
         "difference_255": 3.0},
        {"effect": "mirror", "cpu_seconds": {"estimate": 2.0}, "share": 0.25, "pointers": ["/a"] * 4,
         "difference_255": 12.5},
    ],
    "precision": [
        {"name": "sobol 4 x 4", "ratio": {"estimate": 1.5}, "difference_255": 0.01, "rmse_255": 3.0}
    ],
}  # fmt: skip


def answer(number: int, **members: Any) -> str:
    return answers.answers(MADE | members)[number]["answer"]


def test_the_seconds_for_an_error_are_those_of_the_cheapest_setting_that_keeps_it() -> None:
    first, second, third, last = answer(0).removesuffix(".").split(". ")
    assert first.startswith("4/255: 1.0 s")
    assert first.endswith("sobol 4 x 4")
    assert second.startswith("2/255: 4.0 s")
    assert second.endswith("sobol 16 x 4")
    assert third.startswith("1/255: 4.0 s")
    assert "0.75/255" in last


def test_an_error_that_is_reached_within_an_interval_is_reached() -> None:
    row = setting("sobol 4 x 4", "sobol", 1.0, 2.1) | {"rmse_255": {"estimate": 2.1, "low": 1.9, "high": 2.3}}
    assert "2/255: 1.0 s with" in answer(0, settings=[row])


def test_the_pattern_is_the_quickest_at_the_smallest_error_that_most_reach() -> None:
    best, costs = answer(1).split(". ")
    assert re.findall(r"(\w+) for errors down to ([\d.]+)/255", best) == [("sobol", "2")]
    assert re.findall(r"(\w+) takes ([\d.]+)", costs) == [("sobol", "1.5"), ("random", "4.0")]


def test_a_pattern_may_be_the_quickest_for_large_and_for_small_errors() -> None:
    table = [
        {"rmse_255": level, "cpu_seconds": {"uniform": uniform, "rotated": 2.0}}
        for level, uniform in ((16.0, 1.0), (8.0, 1.5), (4.0, 3.0), (2.0, 1.0))
    ]
    best = re.findall(r"(\w+) for errors down to ([\d.]+)/255", answer(1, equal_error=table))
    assert best == [("uniform", "8"), ("rotated", "4"), ("uniform", "2")]


def test_the_most_expensive_effect_comes_with_its_origin() -> None:
    cost, change = answer(2).split(". ")
    assert cost.startswith("mirror: 2.0 s, 25%")
    assert cost.endswith("/a /a /a and 1 more")
    assert change.endswith("12/255.")


@pytest.mark.parametrize(("difference", "verdict"), [(0.01, "No"), (0.31, "Perhaps")])
def test_double_precision_is_worth_it_where_it_changes_the_picture(difference: float, verdict: str) -> None:
    row = MADE["precision"][0] | {"difference_255": difference}
    assert answer(3, precision=[row]).startswith(verdict)


def test_the_error_after_ten_seconds_continues_with_the_fitted_order() -> None:
    """From 4 s to 10 s by the power -1: 0.75 / 2.5; at a quarter of the size 2.5 s are between the two."""
    assert "0.30/255 (0.19 to 0.47)" in answer(4)
    assert "as 2.5 s here: about 1.2/255" in answer(4)


@pytest.mark.parametrize("order", [None, {"estimate": -1.0, "low": -2.0, "high": 0.1}])
def test_an_error_that_may_not_fall_is_not_extrapolated(order: Any) -> None:
    assert answer(4, methods=[{"method": "sobol", "order": order}]).startswith("less than 0.75/255,")


def test_what_was_not_tried_is_not_answered() -> None:
    empty = {"settings": [], "equal_error": [], "effects": [], "precision": []}
    assert answer(0, **empty).startswith("No setting")
    assert "tried" in answer(1, **empty)
    assert "not tried" in answer(3, **empty)
