"""The frame around all views: addresses, the content security policy, requests."""

from __future__ import annotations

import httpx2
import pytest
from playwright.sync_api import Page, expect

from tests.browser.conftest import Open


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


def test_an_address_without_a_view_says_so(open_page: Open) -> None:
    page = open_page("/compare")
    expect(page.get_by_role("heading", level=1)).to_have_text("There is no such page")
