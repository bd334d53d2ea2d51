"""The site of the documentation follows what is written for a forge."""

import logging
from pathlib import Path, PurePosixPath
from typing import Any

import pytest

from tests.architecture.sources import ROOT
from tools.docs import site_hooks

INDEX = (ROOT / "docs" / "README.md").read_text()
OUTSIDE = site_hooks.outside_pages(INDEX)


def leaves(navigation: Any) -> list[str]:
    """Pages of a navigation, however deep."""
    if isinstance(navigation, str):
        return [navigation]
    parts = navigation.values() if isinstance(navigation, dict) else navigation
    return [page for part in parts for page in leaves(part)]


def test_the_navigation_has_each_page_of_the_documentation_once() -> None:
    inside = [path.relative_to(ROOT / "docs").as_posix() for path in (ROOT / "docs").rglob("*.md")]
    assert sorted(leaves(site_hooks.navigation(INDEX))) == sorted([*inside, *map(str, OUTSIDE)])
    assert PurePosixPath("scenes/gallery/README.md") in OUTSIDE


def test_the_navigation_has_the_sections_and_the_titles_of_the_index() -> None:
    index = (
        "# All\n\n## Learn: tutorials\n\n- [First](tutorials/one.md): x\n\nSee [us](../CONTRIBUTING.md).\n"
    )
    assert site_hooks.navigation(index) == [
        {"Documentation": "README.md"},
        {"Tutorials": [{"First": "tutorials/one.md"}]},
        {"Project": ["CONTRIBUTING.md"]},
    ]


def test_a_page_with_a_folder_of_its_name_has_the_pages_of_the_folder_below_it(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "docs" / "all").mkdir(parents=True)
    (tmp_path / "docs" / "all.md").write_text("[b](all/b.md) [a](all/a.md#x) [c](c.md) [b](all/b.md)\n")
    monkeypatch.setattr(site_hooks, "ROOT", tmp_path)
    docs = PurePosixPath("docs")
    assert site_hooks.entry(docs / "all.md") == [{"Overview": "all.md"}, "all/b.md", "all/a.md"]
    assert site_hooks.entry(docs / "c.md") == "c.md"


@pytest.mark.parametrize(
    ("before", "after"),
    [
        ("text\n- a\n- b\n", "text\n\n- a\n- b\n"),
        ("- a\n  - b\n\n    c\n", "- a\n    - b\n\n        c\n\n"),
        ("1. a\n\n   ```sh\n   b\n   ```\n2. c\n", "1. a\n\n    ```sh\n    b\n    ```\n\n2. c\n"),
        ("1. a\n\n   b\n2. c\n", "1. a\n\n    b\n\n2. c\n"),
        ("- the status is\n  503. It\n", "- the status is\n    503\\. It\n"),
        ("```text\nno list:\n- a\n  b\n```\n", "```text\nno list:\n- a\n  b\n```\n"),
    ],
)
def test_lists_are_indented_as_mkdocs_asks_and_remain_the_same_lists(before: str, after: str) -> None:
    assert site_hooks.with_wide_lists(before) == after
    counts = [site_hooks.elements(site_hooks.FORGE.render(text)) for text in (before, after)]
    assert [counts[0][name] for name in ("li", "pre")] == [counts[1][name] for name in ("li", "pre")]


def test_a_heading_is_reached_by_its_words_and_its_number_among_equal_ones_of_the_page() -> None:
    slugs = site_hooks.Slugs()
    assert slugs("n x n points: 26.6 degrees?", "-") == "n-x-n-points-266-degrees"
    assert [slugs("Again, please", "-"), slugs("Again, please", "-")] == ["again-please", "again-please-1"]
    slugs.start()
    assert slugs("Again, please", "-") == "again-please"


@pytest.mark.parametrize(
    ("here", "before", "after"),
    [
        ("docs/how-to/page.md", "[a](../reference/http.md#x)", "[a](../reference/http.md#x)"),
        ("docs/how-to/page.md", "![a](../images/page.png)", "![a](../images/page.png)"),
        ("docs/README.md", "[a](../scenes/gallery/README.md)", "[a](scenes/gallery/README.md)"),
        ("docs/how-to/page.md", "[a](../../CHANGELOG.md#b)", "[a](../CHANGELOG.md#b)"),
        ("CHANGELOG.md", "[a](docs/how-to/page.md)", "[a](how-to/page.md)"),
        ("scenes/gallery/README.md", "![a](../../docs/images/page.png)", "![a](../../images/page.png)"),
        ("scenes/gallery/README.md", "[basic.json](basic.json)", "`basic.json`"),
        ("docs/explanation/accuracy.md", "[soft](../../scenes/study/soft.json)", "`scenes/study/soft.json`"),
        ("docs/how-to/scaling.md", "[a folder](../../deploy)", "a folder (`deploy`)"),
        ("docs/how-to/page.md", "[a](https://example.org/b.md)", "[a](https://example.org/b.md)"),
        ("docs/how-to/page.md", "[a](#begin)", "[a](#begin)"),
        ("docs/how-to/page.md", "```sh\n[a](../../deploy)\n```", "```sh\n[a](../../deploy)\n```"),
    ],
)
def test_a_link_leads_to_a_page_of_the_site_or_names_its_file(here: str, before: str, after: str) -> None:
    assert site_hooks.relinked(before, PurePosixPath(here), OUTSIDE) == after


def test_a_file_outside_the_site_is_a_link_where_the_address_of_the_repository_is_known() -> None:
    page = PurePosixPath("docs/how-to/scaling.md")
    text = site_hooks.relinked(
        "[units](../../deploy/systemd)", page, OUTSIDE, source="https://example.org/p/"
    )
    assert text == "[units](https://example.org/p/blob/HEAD/deploy/systemd)"


@pytest.mark.parametrize("link", ["[a](../../no_such_file.py)", "![a](../../service/web/icon.svg)"])
def test_what_the_site_cannot_have_is_reported(link: str, caplog: pytest.LogCaptureFixture) -> None:
    with caplog.at_level(logging.WARNING, "mkdocs"):
        site_hooks.relinked(link, PurePosixPath("docs/how-to/page.md"), OUTSIDE)
    assert [record.levelno for record in caplog.records] == [logging.WARNING]


@pytest.mark.parametrize(
    ("text", "addresses"),
    [
        ('<script defer src="https://example.org/a.js"></script>', ["https://example.org/a.js"]),
        ("<link rel=stylesheet href=//example.org/a.css>", ["//example.org/a.css"]),
        ('<img alt="a" src="http://example.org/a.png">', ["http://example.org/a.png"]),
        ("@font-face { src: url('https://example.org/a.woff2') }", ["https://example.org/a.woff2"]),
        ('<a href="https://example.org/">elsewhere</a>', []),
        ('<link rel="canonical" href="https://example.org/">', []),
        ('<img alt="a" src="../images/a.png"><script src="a.js"></script>', []),
    ],
)
def test_what_a_page_fetches_from_another_host_is_found(text: str, addresses: list[str]) -> None:
    assert site_hooks.fetched_elsewhere(text) == addresses


def test_a_bar_in_the_code_of_a_table_loses_its_backslash_as_on_a_forge() -> None:
    source = "| a |\n| --- |\n| `x \\| y` |\n"
    assert "<td><code>x | y</code></td>" in site_hooks.FORGE.render(source)
    assert site_hooks.with_bars(r"<td><code>x \| y</code></td>") == "<td><code>x | y</code></td>"
    assert site_hooks.with_bars(r"<pre>x \| y</pre>") == r"<pre>x \| y</pre>"
