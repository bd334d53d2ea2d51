"""The HTTP reference at /docs, for people, without scripts and without anything from other hosts."""

from html.parser import HTMLParser

import httpx2
import pytest

from tests.service.test_bad_requests import problem_of

VOID = {"meta", "link"}


class Elements(HTMLParser):
    """The ids, links and text of a page; an element that is not closed in its place is an error."""

    def __init__(self) -> None:
        super().__init__()
        self.open: list[str] = []
        self.names: set[str] = set()
        self.ids: list[str] = []
        self.links: list[str] = []
        self.text = ""
        self.cells: list[str] = []

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self.names.add(tag)
        self.ids += [value for name, value in attrs if name == "id" and value]
        self.links += [value for name, value in attrs if name in ("href", "src") and value]
        if tag not in VOID:
            self.open.append(tag)
        if tag == "td":
            self.cells.append("")

    def handle_startendtag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self.links += [value for name, value in attrs if name in ("href", "src") and value]

    def handle_endtag(self, tag: str) -> None:
        assert self.open.pop() == tag

    def handle_data(self, data: str) -> None:
        self.text += data
        if "td" in self.open:
            self.cells[-1] += data


@pytest.fixture
def elements(client: httpx2.Client) -> Elements:
    answer = client.get("/docs")
    assert answer.headers["Content-Type"] == "text/html; charset=utf-8"
    found = Elements()
    found.feed(answer.text)
    assert found.open == []
    return found


def test_the_reference_names_every_call_of_the_openapi_document(
    client: httpx2.Client, elements: Elements
) -> None:
    paths = client.get("/openapi.json").json()["paths"]
    titles = [f"{method.upper()} {path}" for path, methods in paths.items() for method in methods]
    assert len(titles) > 30
    assert [title for title in titles if elements.text.count(title) < 2] == []


def test_defaults_are_shown_as_they_are_sent(elements: Elements) -> None:
    assert "Default: float32." in elements.text
    cells = {"flip", "true or false", "false", "required"}
    assert cells <= set(elements.cells)
    assert "False" not in elements.cells


def test_every_link_of_the_reference_leads_to_its_own_service(
    client: httpx2.Client, elements: Elements
) -> None:
    assert len(set(elements.ids)) == len(elements.ids)
    fragments = {link[1:] for link in elements.links if link.startswith("#")}
    assert fragments <= set(elements.ids)
    for link in {link for link in elements.links if not link.startswith("#")}:
        assert link.startswith("/")
        assert client.get(link).status_code == 200, link


def test_the_reference_runs_no_script(client: httpx2.Client, elements: Elements) -> None:
    assert "script" not in elements.names
    policy = client.get("/docs").headers["Content-Security-Policy"]
    assert "default-src 'none'" in policy


def test_a_browser_that_has_the_reference_does_not_get_it_again(client: httpx2.Client) -> None:
    etag = client.get("/docs").headers["ETag"]
    assert client.get("/docs", headers={"If-None-Match": etag}).status_code == 304


def test_an_unknown_address_is_answered_with_where_the_reference_is(client: httpx2.Client) -> None:
    assert "/docs" in problem_of(client.get("/redoc"), 404)["detail"]
