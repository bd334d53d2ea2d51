"""The report of a tiny study, read back."""

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

    def __init__(self, page: bytes) -> None:
        super().__init__()
        self.loads: list[str] = []
        self.tags: list[str] = []
        self.open: list[str] = []
        self.text = ""
        self.feed(page.decode())

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self.tags.append(tag)
        self.loads += [value or "" for name, value in attrs if name in {"src", "href", "srcset", "data"}]
        if tag not in {"meta", "img"}:
            self.open.append(tag)

    def handle_endtag(self, tag: str) -> None:
        assert self.open.pop() == tag

    def handle_data(self, data: str) -> None:
        self.text += data


def test_page_loads_nothing_and_escapes_names(found: Found) -> None:
    read = Reader(found[1]["report.html"])
    assert read.loads
    assert all(one.startswith(("data:image/png;base64,", "#")) for one in read.loads)
    assert not {"script", "link", "iframe", "object", "b"} & set(read.tags)
    assert read.open == []
    assert SCENE["name"] in read.text
    assert r"small & \<b\>bold\</b\>" in found[1]["report.md"].decode()
    table = Table(("a",), [("<img src=x>|`",)])
    assert "&lt;img src=x&gt;|`" in pages.html("title", [table])
    assert r"\<img src=x\>\|\`" in pages.markdown([table])


def test_report_begins_with_the_answers(found: Found) -> None:
    results, files = found
    for name in ("report.md", "report.html"):
        text = files[name].decode()
        places = [text.index(row["question"]) for row in results["answers"]]
        assert places == sorted(places)
        assert max(places) < text.index("Error against seconds")
    beaten = sum(not row["front"] for row in results["settings"])
    assert beaten
    assert files["report.html"].decode().count('<tr class="grey">') == beaten


def test_plots_are_whole_and_reproducible(found: Found) -> None:
    """Each draws the error of the reference itself."""
    results, files = found
    label = f"error of the reference itself, {report.error(results['reference']['rmse_255'])}"
    drawn = [content.decode() for name, content in files.items() if name.endswith(".svg")]
    assert len(drawn) == 4
    for svg in drawn:
        ElementTree.fromstring(svg)  # noqa: S314 - we drew it ourselves
        assert label in svg
    again = figures.error_against(results, seconds, "seconds")
    assert again.encode() == files["images/seconds.svg"]
    assert again != figures.error_against(results, rays, "rays")


@pytest.mark.slow
def test_report_may_have_no_runs_or_no_errors(tmp_path: Path) -> None:
    study = Study(scene(), tmp_path / "a", TINY, budget=1e-9)
    results = report.answered(study.run(lambda _: None))
    assert "images/front.svg" in report.files(study, results)
    assert results["effects"] == []
    assert all(row["answer"] for row in results["answers"])
    # Without anything in the scene no curve has a point, and the reference is exact.
    study = Study(scene(shapes=[], lights=[]), tmp_path / "b", TINY)
    results = report.answered(study.run(lambda _: None))
    assert results["reference"]["rmse_255"] == 0
    assert not any(row["resolved"] for row in results["settings"])
    assert b"0/255" in report.files(study, results)["images/seconds.svg"]


def setting(name: str, spent: float, off: float) -> dict[str, Any]:
    values = {"cpu_seconds": spent, "rmse_255": off}
    intervals = {key: {"estimate": value, "low": value, "high": value} for key, value in values.items()}
    return {"name": name, "method": "sobol", "resolved": True, "rays": 1, **intervals}


MADE: dict[str, Any] = {
    **dict.fromkeys(("width", "height"), 100),
    **dict.fromkeys(("own_width", "own_height"), 200),
    "size": {"ratio": 4.0},
    "settings": [setting("sobol 4 x 4", 1.0, 3.0), setting("sobol 16 x 4", 4.0, 0.75)],
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
CLOSE = setting("sobol 4 x 4", 1.0, 2.1) | {"rmse_255": {"estimate": 2.1, "low": 1.9, "high": 2.3}}
TURNS = [
    {"rmse_255": level, "cpu_seconds": {"uniform": uniform, "rotated": 2.0}}
    for level, uniform in ((16.0, 1.0), (8.0, 1.5), (4.0, 3.0), (2.0, 1.0))
]


@pytest.mark.parametrize(
    ("number", "members", "said"),
    [
        # The cheapest setting that keeps an error, also within its interval.
        (0, {}, ["4/255: 1.0 s", "2/255: 4.0 s", "1/255: 4.0 s", "0.75/255"]),
        (0, {"settings": [CLOSE]}, ["2/255: 1.0 s"]),
        # The quickest pattern at the smallest error that most reach; it may change with the error.
        (1, {}, ["sobol", "2/255", "sobol takes 1.5", "random takes 4.0"]),
        (1, {"equal_error": TURNS}, ["uniform", "8/255", "rotated", "4/255", "uniform", "2/255"]),
        (2, {}, ["mirror: 2.0 s, 25 %", "/a /a /a and 1 more", "12/255"]),
        (3, {}, ["No"]),
        (3, {"precision": [MADE["precision"][0] | {"difference_255": 0.31}]}, ["Perhaps"]),
        # From 4 s to 10 s by the power -1: 0.75 / 2.5; at a quarter of the size 2.5 s are between the two.
        (4, {}, ["0.30/255 (0.19 to 0.47)", "2.5 s", "1.2/255"]),
        (4, {"methods": [{"method": "sobol", "order": None}]}, ["less than 0.75/255"]),
        (0, {"settings": []}, ["No setting"]),
        (1, {"equal_error": []}, ["tried"]),
        (3, {"precision": []}, ["not tried"]),
    ],
)
def test_answers_follow_from_the_numbers(number: int, members: Any, said: list[str]) -> None:
    text = answers.answers(MADE | members)[number]["answer"]
    assert re.search(".*".join(map(re.escape, said)), text), text


def test_pictures_that_do_not_fill_a_line_leave_cells_empty() -> None:
    strip = Strip("below", [(f"{n}.png", b"", str(n)) for n in range(4)])
    lines = pages.markdown([Heading("title", 1), strip]).splitlines()
    assert {line.count("|") for line in lines if line.startswith("|")} == {4}
    assert "| ![3](images/3.png) |  |  |" in lines
