"""The table of jobs: searched, sorted, followed, cancelled, deleted, paged."""

import json
from typing import Any

import httpx2
import pytest
from playwright.sync_api import Locator, Page, expect

from tests.browser.conftest import Open, Shoot
from tests.browser.scenes import TIMEOUT, endless, small
from tests.service.support import finish, submit


def document(name: str) -> dict[str, Any]:
    return json.loads(small("basic", name=name))


def done(client: httpx2.Client, name: str) -> str:
    job = submit(client, document(name))
    finish(client, job)
    return job


def row(page: Page, name: str) -> Locator:
    return page.get_by_role("row").filter(has=page.get_by_role("link", name=name, exact=True))


def test_jobs_by_state(open_page: Open, client: httpx2.Client) -> None:
    done(client, "ready")
    running = endless(client, "on its way")
    page = open_page("/jobs")
    expect(row(page, "ready")).to_contain_text("✓ finished")
    expect(row(page, "on its way")).to_be_visible()
    page.get_by_label("State").select_option("succeeded")
    expect(row(page, "on its way")).to_have_count(0)
    expect(row(page, "ready")).to_have_count(1)
    assert page.url.endswith("/jobs?state=succeeded")
    page.reload()
    expect(page.get_by_label("State")).to_have_value("succeeded")
    expect(row(page, "ready")).to_have_count(1)
    expect(row(page, "on its way")).to_have_count(0)
    client.post(f"/v1/jobs/{running}/cancel")


@pytest.mark.slow
def test_jobs_by_label(open_page: Open, client: httpx2.Client) -> None:
    for name, week in (("early", "1"), ("late", "12")):
        finish(client, submit(client, document(name), labels={"week": week, "ball": ""}))
    page = open_page("/jobs")
    expect(row(page, "early").get_by_text("ball", exact=True)).to_be_visible()
    row(page, "early").get_by_role("button", name="week:1").click()
    expect(row(page, "late")).to_have_count(0)
    expect(row(page, "early")).to_have_count(1)
    assert page.url.endswith("/jobs?label=week%3A1")
    page.get_by_role("button", name="not only week:1").click()
    expect(row(page, "late")).to_have_count(1)
    page.get_by_role("searchbox", name="Name or label").fill("EK:12")
    expect(row(page, "early")).to_have_count(0)
    expect(row(page, "late")).to_have_count(1)
    expect(page.get_by_role("main")).to_contain_text("1 matching job")
    page.reload()
    expect(page.get_by_role("searchbox", name="Name or label")).to_have_value("EK:12")
    expect(row(page, "late")).to_have_count(1)


def test_job_is_cancelled_from_the_list(open_page: Open, client: httpx2.Client) -> None:
    job = endless(client, "too long")
    page = open_page("/jobs")
    expect(row(page, "too long")).to_contain_text("running", timeout=TIMEOUT)
    page.get_by_role("button", name="Cancel too long").click()
    page.get_by_role("dialog").get_by_role("button", name="Cancel it").click()
    expect(row(page, "too long")).to_contain_text("cancelled", timeout=TIMEOUT)
    assert client.get(f"/v1/jobs/{job}").json()["state"] == "cancelled"


@pytest.mark.slow
def test_deletion_is_confirmed(open_page: Open, client: httpx2.Client) -> None:
    job = done(client, "not needed")
    page = open_page("/jobs")
    page.get_by_role("button", name="Delete not needed").click()
    page.get_by_role("dialog").get_by_role("button", name="Keep it").click()
    expect(row(page, "not needed")).to_have_count(1)
    assert client.get(f"/v1/jobs/{job}").status_code == 200
    page.get_by_role("button", name="Delete not needed").click()
    page.get_by_role("dialog").get_by_role("button", name="Delete").click()
    expect(row(page, "not needed")).to_have_count(0)
    assert client.get(f"/v1/jobs/{job}").status_code == 404


@pytest.mark.slow
def test_two_jobs_are_compared_on_a_phone(open_page: Open, client: httpx2.Client, shoot: Shoot) -> None:
    name = "left of a red ball on a chequered floor"
    older, newer = done(client, name), done(client, "right")
    page = open_page("/jobs", width=390, height=844)
    for fact in ("✓ finished", "1 × center, light 1 ×", " s", "just now"):
        expect(row(page, name).get_by_text(fact).last).to_be_visible()
    link = row(page, name).get_by_role("link")
    assert link.evaluate("({scrollHeight, clientHeight}) => scrollHeight <= clientHeight")
    shoot(page, "jobs-phone")
    compare = page.get_by_role("button", name="Compare")
    expect(compare).to_be_disabled()
    page.get_by_role("checkbox", name="Choose left").check()
    page.get_by_role("checkbox", name="Choose right").check()
    compare.click()
    page.wait_for_url(f"**/compare/{older}/{newer}")


@pytest.mark.slow
def test_many_jobs_are_chosen_at_once(open_page: Open, client: httpx2.Client) -> None:
    for name in ("many c", "many a", "many d", "many b"):
        done(client, name)
    running = endless(client, "many e")
    page = open_page("/jobs?search=many&sort=name")
    names = page.get_by_role("rowheader")
    expect(names).to_have_text([f"many {letter}" for letter in "abcde"])
    page.get_by_role("button", name="Name").click()
    expect(names).to_have_text([f"many {letter}" for letter in "edcba"])
    group = page.get_by_role("group", name="Chosen jobs")
    expect(group.get_by_role("button", name="Delete")).to_be_disabled()
    page.get_by_role("checkbox", name="Choose all").check()
    expect(group.get_by_role("button", name="Delete 5")).to_be_enabled()
    group.get_by_role("button", name="Cancel 1").click()
    page.get_by_role("dialog").get_by_role("button", name="Cancel it").click()
    expect(row(page, "many e")).to_contain_text("cancelled", timeout=TIMEOUT)
    assert client.get(f"/v1/jobs/{running}").json()["state"] == "cancelled"
    page.get_by_role("checkbox", name="Choose all").uncheck()
    page.get_by_role("checkbox", name="Choose many d").check()
    page.get_by_role("checkbox", name="Choose many b").click(modifiers=["Shift"])
    group.get_by_role("button", name="Delete 3").click()
    page.get_by_role("dialog").get_by_role("button", name="Delete").click()
    expect(names).to_have_text(["many e", "many a"])
    assert len(client.get("/v1/jobs?search=many").json()["jobs"]) == 2


@pytest.mark.slow
def test_more_jobs_by_page(open_page: Open, client: httpx2.Client, shoot: Shoot) -> None:
    names = [f"number {number}" for number in range(22)]
    for job in [submit(client, document(name), labels={"course": "graphics"}) for name in names]:
        finish(client, job)
    running = endless(client, "makes the list lively")
    page = open_page("/jobs?search=", width=1440)
    expect(page.get_by_role("rowheader")).to_have_count(20)
    bottom = page.get_by_role("rowheader").last.bounding_box()
    assert bottom
    assert bottom["y"] + bottom["height"] <= 900
    shoot(page, "jobs")
    expect(row(page, names[0])).to_have_count(0)
    page.get_by_role("button", name="More jobs").click()
    expect(row(page, names[0])).to_have_count(1)
    # While a job is active the newest are fetched again and again, the older ones are not.
    asked: list[str] = []
    page.on("request", lambda request: asked.append(request.url))
    while sum("limit=20&" in url for url in asked) < 4:
        page.wait_for_event("request", timeout=TIMEOUT)
    assert sum("limit=100&" in url for url in asked) < 3
    client.post(f"/v1/jobs/{running}/cancel")
    row(page, names[0]).scroll_into_view_if_needed()
    page.evaluate("scrollTo(0, document.body.scrollHeight)")
    top = page.evaluate("scrollY")
    page.wait_for_function("() => history.state?.jobs.top === scrollY")
    row(page, names[0]).get_by_role("link").click()
    page.wait_for_url("**/jobs/*")
    expect(row(page, names[0])).to_have_count(0)
    page.go_back()
    expect(row(page, names[0])).to_be_in_viewport()
    assert page.evaluate("scrollY") == top > 0
