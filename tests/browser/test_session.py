"""A service with keys: the page asks for one once, and then uses a cookie."""

import json
from collections.abc import Iterator

import httpx2
import pytest
from playwright.sync_api import Page, Route, expect

from schemas.api.administration import Role
from service.access import keys
from service.server import RunningServer
from service.settings import Settings
from service.storage.database.connection import Database
from tests.browser.conftest import Open
from tests.browser.scenes import PASTE, TIMEOUT, choose, editor, endless, opened, small, write
from tests.service.forking import running
from tests.service.support import finish, submit, until


@pytest.fixture(scope="module")
def server(tmp_path_factory: pytest.TempPathFactory) -> Iterator[RunningServer]:
    """A service of its own: once a first key exists, every request needs one."""
    with running(
        Settings(data=tmp_path_factory.mktemp("keys"), port=0, workers=1, log_level="error")
    ) as started:
        yield started


@pytest.fixture(scope="module")
def key(server: RunningServer) -> str:
    """A key; once it exists, every request needs one."""
    database = Database(Settings(data=server.data).database_url)
    with database.writing() as session:
        made = str(keys.add(session, "ada", Role.SUBMIT))
    database.close()
    # A service caches for a while that there are no keys.
    with httpx2.Client(base_url=server.url) as client:
        until(lambda: client.get("/v1/jobs").status_code == 401)
    return made


def held(page: Page, routes: list[Route], count: int) -> None:
    """Wait until so many requests are held back, while the page keeps running."""
    until(lambda: page.evaluate("true") and len(routes) == count)


def give(page: Page, key: str) -> None:
    page.get_by_role("dialog").get_by_label("Key").fill(key)
    page.get_by_role("dialog").get_by_role("button", name="Sign in").click()


def test_key_is_asked_for_once(open_page: Open, key: str) -> None:
    page = open_page("/")
    give(page, key)
    opened(page)
    expect(page.locator("#session")).to_contain_text("ada", timeout=TIMEOUT)
    expect(page.locator('nav a[href="/service"]')).to_be_hidden()
    page.reload()
    opened(page)
    expect(page.get_by_role("dialog")).to_have_count(0)


@pytest.mark.slow
def test_late_refusal(open_page: Open, key: str) -> None:
    page = open_page("/jobs")
    late: list[Route] = []

    def hold(route: Route) -> None:
        late.append(route)

    expect(page.get_by_role("dialog")).to_have_count(1, timeout=TIMEOUT)
    page.route("**/v1/jobs?held*", hold)
    # Send the request without waiting for its answer.
    page.evaluate(
        """() => {
          const api = new URL("api.js", document.querySelector("script[type=module]").src).href;
          const answer = import(api).then(({ get }) => get("/v1/jobs?held=1"));
          answer.then(() => (window.held = "answered"));
        }"""
    )
    held(page, late, 1)
    give(page, key)
    expect(page.get_by_role("dialog")).to_have_count(0)
    late[0].fulfill(status=401, json={"detail": "Without a key nothing is answered."})
    held(page, late, 2)
    late[1].fulfill(json={"jobs": []})
    page.wait_for_function("window.held === 'answered'")
    expect(page.get_by_role("dialog")).to_have_count(0)


@pytest.mark.slow
def test_wrong_key(open_page: Open, key: str) -> None:
    page = open_page("/jobs")
    give(page, "not-a-key")
    expect(page.get_by_role("dialog").get_by_role("alert")).not_to_be_empty()
    give(page, key)
    expect(page.get_by_role("dialog")).to_have_count(0)
    expect(page.get_by_text("Nothing")).to_be_visible(timeout=TIMEOUT)


@pytest.mark.slow
@pytest.mark.parametrize("wrong", ["pnm_nobody", "pnm_\u0142", "two words"])
def test_wrong_key_is_told_in_words_about_keys(open_page: Open, key: str, wrong: str) -> None:
    page = open_page("/jobs")
    give(page, wrong)
    alert = page.get_by_role("dialog").get_by_role("alert")
    expect(alert).to_contain_text("key", timeout=TIMEOUT)
    expect(alert).not_to_contain_text("Bearer")
    give(page, key)
    expect(page.get_by_role("dialog")).to_have_count(0)


@pytest.mark.slow
def test_not_now_is_final_until_asked(open_page: Open, key: str) -> None:
    page = open_page("/jobs")
    dialog = page.get_by_role("dialog")
    dialog.get_by_role("button", name="Not now").click()
    page.get_by_role("link", name="Start").click()
    expect(page.get_by_role("heading", level=1)).to_have_text("Basic", timeout=TIMEOUT)
    page.wait_for_timeout(1000)
    expect(dialog).to_have_count(0)
    page.locator("#session").get_by_role("button", name="Sign in").click()
    give(page, key)
    opened(page)


@pytest.mark.slow
def test_key_after_leaving(open_page: Open, key: str) -> None:
    page = open_page("/jobs")
    give(page, key)
    page.get_by_role("button", name="Sign out").click()
    expect(page.get_by_role("dialog")).to_be_visible(timeout=TIMEOUT)
    assert page.context.cookies() == []


# The texts that all tabs keep in the browser.
STORED = """() => new Promise((done) => {
  const opening = indexedDB.open("penumbra");
  opening.onsuccess = () => {
    const asked = opening.result.transaction("texts").objectStore("texts").getAll();
    asked.onsuccess = () => (opening.result.close(), done(JSON.stringify(asked.result)));
  };
})"""


@pytest.mark.slow
def test_signing_out_leaves_no_scene_in_any_tab(open_page: Open, key: str) -> None:
    page = open_page("/")
    give(page, key)
    opened(page)
    other = page.context.new_page()
    other.goto("/")
    for tab in (page, other):
        opened(tab)
        write(tab, small("basic", name="solution of ada"))
        opened(tab)
    # What is replaced is a recent scene.
    choose(page, "Falloff")
    page.get_by_role("button", name="Replace it").click()
    until(lambda: "solution of ada" in page.evaluate(STORED))
    opened(page)
    # The last words are not kept yet when the page is left.
    editor(page).press("Control+A")
    leave = (
        f"(element, text) => (({PASTE})(element, text), document.querySelector('#session button').click())"
    )
    editor(page).evaluate(leave, small("basic", name="last words of ada"))
    for tab in (page, other):
        expect(tab.get_by_role("dialog")).to_be_visible(timeout=TIMEOUT)
    give(page, key)
    give(other, key)
    for tab in (page, other):
        opened(tab)
        expect(editor(tab)).not_to_contain_text("of ada")
        assert "ada" not in str(tab.evaluate("JSON.stringify(sessionStorage)"))
    assert "ada" not in page.evaluate(STORED)


@pytest.mark.slow
def test_session_that_ends_while_watching(open_page: Open, server: RunningServer, key: str) -> None:
    with httpx2.Client(base_url=server.url, headers={"Authorization": f"Bearer {key}"}) as client:
        job = endless(client, "watched")
        page = open_page(f"/jobs/{job}")
        give(page, key)
        expect(page.locator(".job-progress .state")).to_have_text("▶ running", timeout=TIMEOUT)
        page.context.clear_cookies()
        dialog = page.get_by_role("dialog")
        expect(dialog).to_be_visible(timeout=TIMEOUT)
        dialog.get_by_role("button", name="Not now").click()
        notice = page.get_by_text("The page no longer follows this job.")
        expect(notice).to_be_visible()
        expect(page.get_by_text("This job was deleted.")).to_be_hidden()
        asked: list[str] = []
        page.on("request", lambda request: asked.append(request.url))
        page.wait_for_timeout(2500)
        assert asked == []
        expect(dialog).to_have_count(0)
        page.get_by_role("button", name="Sign in").click()
        give(page, key)
        expect(page.locator(".job-progress .state")).to_have_text("▶ running", timeout=TIMEOUT)
        client.post(f"/v1/jobs/{job}/cancel")


@pytest.mark.slow
def test_staff_see_owners_and_buttons_that_work(open_page: Open, server: RunningServer, key: str) -> None:
    database = Database(Settings(data=server.data).database_url)
    with database.writing() as session:
        staff = str(keys.add(session, "grace", Role.STAFF))
    database.close()
    for one, name in ((key, "of ada"), (staff, "of grace")):
        with httpx2.Client(base_url=server.url, headers={"Authorization": f"Bearer {one}"}) as client:
            finish(client, submit(client, json.loads(small("basic", name=name))))
    page = open_page("/jobs")
    give(page, staff)
    row = page.get_by_role("row").filter(has_text="of ada")
    expect(row.get_by_role("cell", name="ada", exact=True)).to_be_visible()
    expect(page.get_by_role("columnheader", name="User")).to_be_visible()
    expect(page.get_by_role("button", name="Delete of grace")).to_be_visible()
    expect(page.get_by_role("button", name="Delete of ada")).to_be_hidden()
    page.get_by_role("checkbox", name="Choose all").check()
    expect(page.get_by_role("button", name="Delete 1")).to_be_enabled()
    for name, works in (("of grace", True), ("of ada", False)):
        page.goto("/jobs")
        page.get_by_role("link", name=name).click()
        page.wait_for_load_state("networkidle")
        expect(page.get_by_role("link", name="Change and render again")).to_be_visible()
        expect(page.get_by_role("button", name="Delete", exact=True)).to_be_visible(visible=works)
