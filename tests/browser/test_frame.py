"""The frame around all views: addresses, the content security policy, requests."""

from __future__ import annotations

import re

import httpx2
import pytest
from playwright.sync_api import Page, expect

from tests.browser.conftest import Open
from tests.browser.scenes import TIMEOUT, drop, expect_written, small


@pytest.mark.parametrize("path", ["/", "/jobs", "/jobs/0123456789abcdef", "/compare/a/b"])
def test_every_address_of_the_page_can_be_opened_directly(client: httpx2.Client, path: str) -> None:
    answer = client.get(path)
    assert answer.status_code == 200
    assert answer.headers["content-type"] == "text/html; charset=utf-8"


@pytest.mark.parametrize(
    "path", ["/web/../app.py", "/web/%2e%2e/app.py", "/web/views", "/web/a%00.js", "/web//main.js"]
)
def test_nothing_but_files_of_the_page_is_answered(client: httpx2.Client, path: str) -> None:
    assert client.get(path).status_code == 404


def test_a_file_that_the_browser_has_costs_no_transfer(client: httpx2.Client) -> None:
    first = client.get("/web/main.js")
    again = client.get("/web/main.js", headers={"If-None-Match": first.headers["etag"]})
    assert (again.status_code, again.content) == (304, b"")
    # Browsers replace the headers that they have stored by these.
    rules = "content-security-policy"
    assert again.headers[rules] == first.headers[rules] == client.get("/").headers[rules]


def test_files_of_the_page_are_kept_by_browsers_until_they_change(client: httpx2.Client) -> None:
    index = client.get("/")
    assert index.headers["cache-control"] == "no-cache"
    addresses = re.findall(r'(?:src|href)="(/web/[^"]+)"', index.text)
    assert any(address.endswith("/main.js") for address in addresses)
    for address in addresses:
        answer = client.get(address)
        assert "immutable" in answer.headers["cache-control"]
        # The same file, under the name that it has in the repository.
        plain = client.get(re.sub("/v-[0-9a-f]{16}/", "/", address))
        assert (plain.content, plain.headers["cache-control"]) == (answer.content, "no-cache")
        # A page that was opened before an upgrade still works, and no cache keeps what it gets.
        older = client.get(re.sub("/v-[0-9a-f]{16}/", f"/v-{'0' * 16}/", address))
        assert (older.content, older.headers["cache-control"]) == (answer.content, "no-cache")


def test_a_page_that_is_opened_again_asks_for_its_document_alone(open_page: Open) -> None:
    page = open_page("/jobs")
    expect(page.get_by_role("heading", level=1)).to_have_text("Jobs")
    before = page.evaluate("performance.getEntriesByType('resource').length")
    assert before > 10
    page.goto(page.url)
    expect(page.get_by_role("heading", level=1)).to_have_text("Jobs")
    # What comes from the browser's cache has no bytes transferred.
    sent = """() => performance.getEntriesByType("resource")
      .filter(({ name, transferSize }) => name.includes("/web/") && transferSize > 0)
      .map(({ name }) => name)"""
    assert page.evaluate(sent) == []


@pytest.mark.parametrize("path", ["/", "/web/main.js", "/web/style.css", "/gallery/basic.json", "/docs"])
def test_text_of_the_page_is_compressed_where_the_browser_accepts_that(
    client: httpx2.Client, path: str
) -> None:
    plain, packed = (client.get(path, headers={"Accept-Encoding": coding}) for coding in ("identity", "gzip"))
    assert "content-encoding" not in plain.headers
    assert packed.headers["content-encoding"] == "gzip"
    assert int(packed.headers["content-length"]) < len(plain.content) / 1.5
    assert packed.content == plain.content
    # Two representations: a cache must not give the one for the other.
    assert packed.headers["etag"] != plain.headers["etag"]
    assert packed.headers["vary"] == plain.headers["vary"] == "Accept-Encoding"
    known = {"Accept-Encoding": "gzip", "If-None-Match": packed.headers["etag"]}
    assert client.get(path, headers=known).status_code == 304


@pytest.mark.parametrize("path", ["/web/thumbnails/basic.webp", "/v1/jobs", "/v1/session", "/web/none.js"])
def test_pictures_and_answers_for_one_user_are_not_compressed(client: httpx2.Client, path: str) -> None:
    answer = client.get(path, headers={"Accept-Encoding": "gzip"})
    assert "content-encoding" not in answer.headers


def test_the_policy_forbids_all_that_does_not_come_from_the_service(client: httpx2.Client) -> None:
    policy = client.get("/").headers["content-security-policy"]
    directives = dict(part.strip().split(" ", 1) for part in policy.split(";"))
    assert directives["default-src"] == "'none'"
    assert directives["script-src"] == directives["style-src"] == directives["connect-src"] == "'self'"


def test_views_change_without_loading_the_page_again(page: Page) -> None:
    page.evaluate("window.mark = 1")
    page.get_by_role("link", name="Jobs").click()
    expect(page.get_by_role("heading", level=1)).to_have_text("Jobs")
    page.go_back()
    expect(page.get_by_role("link", name="Start")).to_have_attribute("aria-current", "page")
    assert page.evaluate("window.mark") == 1


@pytest.mark.parametrize("path", ["/nothing", "/jobs/a/b", "/jobs/%E0%A4"])
def test_an_address_without_a_view_says_so(open_page: Open, path: str) -> None:
    page = open_page(path)
    expect(page.get_by_role("heading", level=1)).to_have_text("There is no such page")
    page.get_by_role("main").get_by_role("link", name="jobs").click()
    expect(page.get_by_role("heading", level=1)).to_have_text("Jobs")


def test_an_unknown_address_is_the_page_for_browsers_and_a_problem_for_programs(
    client: httpx2.Client,
) -> None:
    shown = client.get("/nothing", headers={"Accept": "text/html,*/*;q=0.8"})
    assert (shown.status_code, shown.headers["content-type"]) == (404, "text/html; charset=utf-8")
    answer = client.get("/nothing", headers={"Accept": "*/*"})
    assert (answer.status_code, answer.headers["content-type"]) == (404, "application/problem+json")


def test_comparing_without_pictures_says_where_to_choose_them(open_page: Open) -> None:
    page = open_page("/compare")
    page.get_by_role("main").get_by_role("link", name="jobs").click()
    expect(page.get_by_role("button", name="Compare two")).to_be_visible()


def test_a_scene_dropped_on_any_view_is_opened(open_page: Open) -> None:
    page = open_page("/jobs")
    drop(page, mine__json=small("basic").encode())
    expect(page.get_by_role("heading", level=2, name="mine.json")).to_be_visible(timeout=TIMEOUT)
    expect_written(page, small("basic"))


def test_another_file_dropped_on_a_view_leaves_it_as_it_is(open_page: Open) -> None:
    page = open_page("/jobs")
    drop(page, tiles__png=b"a picture")
    page.get_by_role("dialog").get_by_role("button", name="OK").click()
    expect(page.get_by_role("heading", level=1)).to_have_text("Jobs")


@pytest.mark.parametrize("held", ["**/web/views/*.js", "**/v1/jobs**"], ids=["the view", "its content"])
@pytest.mark.parametrize("path", ["/jobs", "/jobs/0123456789abcdef"])
def test_on_a_slow_link_the_frame_and_a_placeholder_are_there_at_once(
    open_page: Open, path: str, held: str
) -> None:
    page = open_page("/compare")
    # Requests that are not answered yet.
    page.route(held, lambda _: None)
    page.goto(path, wait_until="commit")
    expect(page.locator(".skeleton .bone").first).to_be_visible(timeout=TIMEOUT)
    expect(page.get_by_role("navigation", name="Pages")).to_be_visible()
    page.unroute(held)
