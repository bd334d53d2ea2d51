"""The HTML page: it loads no resources, runs no scripts, and shows untrusted text as text."""

import re
from html.parser import HTMLParser
from pathlib import Path

import pytest

from schemas.grading.grades import Grade
from service.grading.exports import EXPORTS
from service.grading.exports.texts import line
from tests.service.grading.exports.samples import (
    FOR_STAFF,
    HIDDEN,
    HOSTILE,
    broken,
    drawn,
    failed,
    hostile,
    not_gradable,
    result,
    secret,
    tried,
)

ELEMENTS = re.compile(
    "html|head|meta|title|style|body|main|h1|h2|p|strong|table|tr|th|td|section|ul|li|figure|svg|image|rect|"
    "figcaption|footer|code"
)
ATTRIBUTES = re.compile(
    "lang|charset|http-equiv|content|name|class|role|aria-label|href|viewbox|width|height|x|y"
)


class Page(HTMLParser):
    """A parsed page: its text, elements and attributes, and the elements that are still open."""

    def __init__(self, content: bytes) -> None:
        super().__init__()
        self.words = ""
        self.attributes: list[tuple[str, str, str]] = []
        self.tags: list[str] = []
        self.open: list[str] = []
        self.feed(content.decode())
        self.close()

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self.tags.append(tag)
        self.attributes += [(tag, name, value or "") for name, value in attrs]
        if tag not in {"meta", "rect", "image"}:
            self.open.append(tag)

    def handle_startendtag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self.tags.append(tag)
        self.attributes += [(tag, name, value or "") for name, value in attrs]

    def handle_endtag(self, tag: str) -> None:
        assert self.open.pop() == tag

    def handle_data(self, data: str) -> None:
        self.words += data


def page(form: str, grade: Grade, pictures: Path | None = None) -> Page:
    found = Page(EXPORTS[form](grade, pictures))
    assert found.open == []
    return found


@pytest.mark.parametrize("form", ["html", "html-staff"])
def test_untrusted_strings_are_text_on_a_page(tmp_path: Path, form: str) -> None:
    found = page(form, drawn(tmp_path, hostile(), 104, 24), tmp_path)
    assert all(ELEMENTS.fullmatch(tag) for tag in found.tags)
    assert all(ATTRIBUTES.fullmatch(name) for _, name, _ in found.attributes)
    for words in HOSTILE:
        assert line(words) in " ".join(found.words.split())


@pytest.mark.parametrize("form", ["html", "html-staff"])
def test_page_loads_no_resources_and_forbids_them(tmp_path: Path, form: str) -> None:
    content = EXPORTS[form](drawn(tmp_path, hostile(), 104, 24), tmp_path)
    found = Page(content)
    assert all(
        value.startswith("data:image/png;base64,") for _, name, value in found.attributes if name == "href"
    )
    assert not re.search(r"url\(|@import", content.decode())
    policy = next(value for _, name, value in found.attributes if name == "content" and "src" in value)
    assert policy.startswith("default-src 'none'; img-src data:;")


@pytest.mark.parametrize("form", ["html", "html-staff"])
def test_pictures_are_named_by_their_tests_in_the_main_part(tmp_path: Path, form: str) -> None:
    tests = tried("first", name="Soft & far"), failed("second", name="Near")
    found = page(form, drawn(tmp_path, result(*tests), 104, 24), tmp_path)
    labels = [value for tag, name, value in found.attributes if (tag, name) == ("svg", "aria-label")]
    assert [label.split(":")[0] for label in labels] == ["Soft & far", "Near"]
    assert found.tags.count("main") == 1


def test_staff_see_hidden_tests_signals_and_files(tmp_path: Path) -> None:
    words = page("html-staff", drawn(tmp_path, result(tried(), secret()), 104, 24), tmp_path).words
    assert f"{HIDDEN.capitalize()} (hidden)" in words
    assert FOR_STAFF in words
    assert "soft.png (submission)" in words
    assert "abababababababab" in words


def test_page_without_pictures_names_the_worst_region() -> None:
    assert "columns 2 to 9, rows 3 to 8, mostly ball" in page("html", result(failed())).words


def test_open_tests_have_no_points_on_a_page() -> None:
    words = page("html", result(tried(), not_gradable(), broken())).words
    assert "Camera: –" in words
    assert "20 points are open, not lost." in words


@pytest.mark.parametrize(
    ("width", "lefts"), [(104, ["2", "38", "74"]), (32, ["2"]), (50, [])], ids=["three", "one", "neither"]
)
def test_worst_region_is_outlined_in_each_picture(tmp_path: Path, width: int, lefts: list[str]) -> None:
    found = page("html", drawn(tmp_path, result(failed()), width, 24), tmp_path)
    assert [value for tag, name, value in found.attributes if (tag, name) == ("rect", "x")] == lefts
    assert {value for tag, name, value in found.attributes if (tag, name) == ("rect", "width")} <= {"8"}
