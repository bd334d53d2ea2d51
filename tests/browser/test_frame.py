"""The frame around all views: addresses, the content security policy, requests."""

import httpx2
import pytest
from playwright.sync_api import Page, expect

from tests.browser.conftest import Open
from tests.browser.pictures import finished
from tests.browser.scenes import TIMEOUT, drop, expect_written, small
from tests.service.support import scene, submit


@pytest.mark.parametrize(
    "path", ["/web/../app.py", "/web/%2e%2e/app.py", "/web/views", "/web/a%00.js", "/web//main.js"]
)
def test_other_files_are_not_served(client: httpx2.Client, path: str) -> None:
    assert client.get(path).status_code == 404


@pytest.mark.slow
@pytest.mark.parametrize("path", ["/", "/web/main.js", "/web/style.css", "/gallery/basic.json", "/docs"])
def test_text_is_compressed(client: httpx2.Client, path: str) -> None:
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


def test_content_security_policy(client: httpx2.Client) -> None:
    policy = client.get("/").headers["content-security-policy"]
    directives = dict(part.strip().split(" ", 1) for part in policy.split(";"))
    assert directives["default-src"] == "'none'"
    assert directives["script-src"] == directives["style-src"] == directives["connect-src"] == "'self'"


@pytest.mark.slow
def test_views_change_without_a_load(page: Page) -> None:
    page.evaluate("window.mark = 1")
    page.get_by_role("link", name="Jobs").click()
    expect(page.get_by_role("heading", level=1)).to_have_text("Jobs")
    page.go_back()
    expect(page.get_by_role("link", name="Start")).to_have_attribute("aria-current", "page")
    assert page.evaluate("window.mark") == 1


@pytest.mark.slow
def test_view_that_cannot_be_loaded(page: Page) -> None:
    page.route("**/views/jobs.js", lambda route: route.abort("internetdisconnected"))
    page.get_by_role("link", name="Jobs").click()
    expect(page.get_by_role("alert")).to_contain_text("does not answer, or has been updated")
    page.unroute_all()
    page.get_by_role("button", name="Load the page again").click()
    expect(page.get_by_role("heading", level=1)).to_have_text("Jobs")


@pytest.mark.slow
def test_unknown_address(client: httpx2.Client) -> None:
    shown = client.get("/nothing", headers={"Accept": "text/html,*/*;q=0.8"})
    assert (shown.status_code, shown.headers["content-type"]) == (404, "text/html; charset=utf-8")
    answer = client.get("/nothing", headers={"Accept": "*/*"})
    assert (answer.status_code, answer.headers["content-type"]) == (404, "application/problem+json")


@pytest.mark.slow
def test_scene_dropped_on_any_view(open_page: Open) -> None:
    page = open_page("/jobs")
    drop(page, mine__json=small("basic").encode())
    expect(page.get_by_role("heading", level=1, name="mine.json")).to_be_visible(timeout=TIMEOUT)
    expect_written(page, small("basic"))


@pytest.mark.slow
@pytest.mark.parametrize("held", ["**/web/views/*.js", "**/v1/jobs**"], ids=["the view", "its content"])
@pytest.mark.parametrize("path", ["/jobs", "/jobs/0123456789abcdef"])
def test_slow_link_shows_the_frame_at_once(open_page: Open, path: str, held: str) -> None:
    page = open_page("/compare")
    # Requests that are not answered yet.
    page.route(held, lambda _: None)
    page.goto(path, wait_until="commit")
    expect(page.locator(".skeleton .bone").first).to_be_visible(timeout=TIMEOUT)
    expect(page.get_by_role("navigation", name="Pages")).to_be_visible()
    page.unroute(held)


SHIFTED = """(() => {
  window.shifted = 0;
  new PerformanceObserver((list) => {
    for (const { value, hadRecentInput } of list.getEntries()) if (!hadRecentInput) window.shifted += value;
  }).observe({ type: "layout-shift", buffered: true });
})()"""
MAX_SHIFTED = 0.1
"""Web Vitals call a sum of shifts up to this good."""


@pytest.mark.slow
@pytest.mark.parametrize(
    "size", [(1440, 900), (1280, 720), (390, 844)], ids=lambda size: "{} x {}".format(*size)
)
def test_views_do_not_move_while_they_load(
    open_page: Open, client: httpx2.Client, size: tuple[int, int]
) -> None:
    floor = scene() | {"shapes": scene()["shapes"][:1]}
    pair = finished(client), finished(client, floor)
    page = open_page("/docs", width=size[0], height=size[1])
    page.add_init_script(SHIFTED)
    samples = {"pattern": "sobol", "samples": size[0]}
    job = submit(client, floor, quality={"mode": "fixed", "antialiasing": samples})
    for path, ready in (
        (f"/jobs/{job}", ".state.succeeded"),
        ("/compare/{}/{}".format(*pair), ".verdict"),
        ("/jobs", ".jobs tbody tr"),
        ("/", ".quote dl"),
    ):
        page.goto(path)
        expect(page.locator(ready).first).to_be_visible(timeout=TIMEOUT)
        page.wait_for_load_state("networkidle")
        assert page.evaluate("window.shifted") < MAX_SHIFTED, path
