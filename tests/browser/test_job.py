"""The page of a job, apart from its picture: state, figures, the plan with its lines, memory."""

import json
import re
from typing import Any

import httpx2
import pytest
from playwright.sync_api import CDPSession, Page, expect

from service.server import RunningServer
from tests.browser.conftest import Open, Shoot
from tests.browser.pictures import tab
from tests.browser.scenes import TIMEOUT, VIEW, endless, opened, render_button, small
from tests.service.support import finish, submit, until
from tests.service.test_damaged_files import change


@pytest.fixture
def text() -> str:
    return small("basic")


@pytest.fixture
def job(client: httpx2.Client, text: str) -> str:
    body = f'{{"scene":{text}}}'
    sent = client.post("/v1/jobs", content=body, headers={"Content-Type": "application/json"})
    finish(client, sent.json()["id"])
    return sent.json()["id"]


@pytest.mark.slow
def test_stage_shows_its_line(open_page: Open, job: str) -> None:
    page = open_page(f"/jobs/{job}")
    tab(page, "Plan")
    stage = page.get_by_role("listitem").filter(has_text="hits of ellipsoids")
    page.get_by_text("more stages").click(timeout=TIMEOUT)
    stage.get_by_role("button", name="cobalt pebble").click()
    pointed = page.locator(".line.pointed")
    expect(pointed.first).to_have_text(re.compile(r"^\s*\{"))
    expect(pointed.filter(has_text='"cobalt pebble"')).to_be_in_viewport()


@pytest.mark.slow
def test_job_is_rendered_again(open_page: Open, job: str, text: str) -> None:
    page = open_page(f"/jobs/{job}")
    page.get_by_role("link", name="Change and render again").click()
    opened(page)
    # Laid out for people again, as the service keeps scenes without blanks.
    assert json.loads(page.evaluate(VIEW, "")["text"]) == json.loads(text)


@pytest.mark.slow
def test_picture_that_existed_takes_no_time(open_page: Open, client: httpx2.Client) -> None:
    scene = {"scene": json.loads(small("basic", name="twice"))}
    first = client.post("/v1/jobs", json=scene).json()["id"]
    until(lambda: client.get(f"/v1/jobs/{first}").json()["state"] == "succeeded")
    second = client.post("/v1/jobs", json=scene).json()["id"]
    page = open_page(f"/jobs/{second}")
    expect(page.get_by_text("Existed already")).to_be_visible(timeout=TIMEOUT)
    page.goto("/jobs")
    entry = page.get_by_role("row").filter(has=page.locator(f'a[href="/jobs/{second}"]'))
    expect(entry).to_contain_text("existed already")


@pytest.mark.slow
def test_running_job_is_cancelled(open_page: Open, client: httpx2.Client) -> None:
    job = endless(client, "stopped on its page")
    page = open_page(f"/jobs/{job}")
    expect(page.locator(".job-progress .state")).to_have_text("▶ running", timeout=TIMEOUT)
    expect(page).to_have_title(re.compile(r"^▶ \d+\s% stopped on its page"))
    page.get_by_role("button", name="Cancel").click()
    question = page.get_by_role("dialog", name="stopped on its page")
    question.get_by_role("button", name="Keep it").click()
    assert client.get(f"/v1/jobs/{job}").json()["state"] == "running"
    page.get_by_role("button", name="Cancel").click()
    question.get_by_role("button", name="Cancel it").click()
    expect(page.locator(".job-progress .state")).to_have_text("■ cancelled", timeout=TIMEOUT)
    expect(page).to_have_title("■ stopped on its page · Penumbra")
    expect(page.get_by_role("button", name="Cancel")).to_have_count(0)


@pytest.mark.slow
@pytest.mark.parametrize(
    "quality",
    [
        {"mode": "target", "error": 0.05, "confidence": 0.99, "precision": "double"},
        {
            "mode": "fixed",
            "antialiasing": {"pattern": "center", "samples": 1},
            "light": {"pattern": "sobol", "samples": 2},
            "precision": "double",
        },
    ],
    ids=lambda quality: quality["mode"],
)
def test_render_again_keeps_the_quality(
    open_page: Open, client: httpx2.Client, shoot: Shoot, quality: dict[str, Any]
) -> None:
    job = submit(client, json.loads(small("basic")), quality=quality)
    page = open_page(f"/?job={job}")
    expect(page.get_by_label("Arithmetic")).to_have_value("double", timeout=TIMEOUT)
    opened(page)
    shoot(page, f"start-again-{quality['mode']}")
    render_button(page).click()
    page.wait_for_url(re.compile("/jobs/(?!" + job + ")"), timeout=TIMEOUT)
    again = client.get(f"/v1/jobs/{page.url.rsplit('/', 1)[1]}/request").json()["quality"]
    # The page shows errors in code values, with six digits.
    assert again.get("error") == pytest.approx(quality.get("error"), rel=1e-5 if "error" in quality else None)
    assert again | {"error": None} == quality | {"error": None}


@pytest.mark.slow
def test_paused_job_is_resumed(open_page: Open, client: httpx2.Client, shoot: Shoot) -> None:
    job = endless(client, "held")
    page = open_page(f"/jobs/{job}")
    state = page.locator(".job-progress .state")
    expect(state).to_have_text("▶ running", timeout=TIMEOUT)
    page.get_by_role("button", name="Pause").click()
    expect(state).to_have_text("‖ paused", timeout=TIMEOUT)
    # Tiles in progress are finished, and no more are started.
    until(lambda: client.get(f"/v1/jobs/{job}").json()["rendering"] == [])
    still = client.get(f"/v1/jobs/{job}").json()
    assert (still["paused"], still["state"]) == (True, "running")
    page.reload()
    expect(state).to_have_text("‖ paused", timeout=TIMEOUT)
    shoot(page, "job-paused")
    page.get_by_role("button", name="Resume").click()
    expect(state).to_have_text("▶ running", timeout=TIMEOUT)
    until(lambda: client.get(f"/v1/jobs/{job}").json()["rendering"] != [])
    client.post(f"/v1/jobs/{job}/cancel")
    expect(page.get_by_role("button", name="Pause")).to_be_hidden(timeout=TIMEOUT)


@pytest.mark.slow
def test_job_deleted_elsewhere(open_page: Open, client: httpx2.Client) -> None:
    job = endless(client, "deleted elsewhere")
    page = open_page(f"/jobs/{job}")
    state = page.locator(".job-progress .state")
    expect(state).to_have_text("▶ running", timeout=TIMEOUT)
    # Refused as long as workers have not stopped its tiles.
    until(lambda: client.delete(f"/v1/jobs/{job}").is_success)
    expect(state).to_have_text("✕ deleted", timeout=TIMEOUT)
    expect(page.get_by_text("This job was deleted.")).to_be_visible()
    for name in ("Pause", "Cancel", "Delete", "This part first"):
        expect(page.get_by_role("button", name=name, exact=True)).to_be_hidden()
    expect(page.get_by_text("Download")).to_be_hidden()


@pytest.mark.slow
def test_job_opened_while_the_service_is_away(open_page: Open, job: str) -> None:
    page = open_page("/jobs")
    link = page.locator(f'a.name[href="/jobs/{job}"]')
    link.click()
    expect(page.locator(".job-progress .state")).to_be_visible(timeout=TIMEOUT)
    page.go_back()
    expect(link).to_be_visible(timeout=TIMEOUT)
    page.context.set_offline(True)
    link.click()
    expect(page.get_by_text("The service does not answer. Trying again")).to_be_visible()
    page.context.set_offline(False)
    expect(page.locator(".job-progress .state")).to_have_text("✓ finished", timeout=TIMEOUT)


@pytest.mark.slow
def test_damaged_picture_says_what_to_do(
    open_page: Open, client: httpx2.Client, server: RunningServer, shoot: Shoot
) -> None:
    job = submit(client, json.loads(small("basic", name="damaged")))
    render = finish(client, job)["id"]
    (stored,) = (server.data / "jobs" / render).glob("*-image.npy")
    change(stored)
    page = open_page(f"/jobs/{job}")
    expect(page.get_by_role("status").filter(has_text="submit the job again")).to_be_visible()
    expect(page.get_by_role("button", name="Sign in")).to_have_count(0)
    shoot(page, "job-damaged")


@pytest.mark.slow
def test_unknown_job(open_page: Open) -> None:
    page = open_page("/jobs/0123456789abcdef")
    expect(page.get_by_role("heading", level=1)).to_have_text("This job cannot be shown")


def counts(session: CDPSession) -> dict[str, float]:
    """Objects that the page holds after garbage collection."""
    session.send("HeapProfiler.collectGarbage")
    metrics = session.send("Performance.getMetrics")["metrics"]
    return {
        found["name"]: found["value"] for found in metrics if found["name"] in {"JSEventListeners", "Nodes"}
    }


def visit_all(page: Page, job: str, times: int) -> None:
    for _ in range(times):
        page.get_by_role("link", name="Jobs").click()
        page.locator(f'a.name[href="/jobs/{job}"]').click()
        tab(page, "Plan")
        expect(page.locator(".stages li").first).to_be_visible(timeout=TIMEOUT)
        page.get_by_role("link", name="Start").click()
        expect(page.get_by_role("button", name="Render", exact=True)).to_be_enabled(timeout=TIMEOUT)


@pytest.mark.slow
def test_left_views_leave_nothing(open_page: Open, job: str) -> None:
    page = open_page("/")
    session = page.context.new_cdp_session(page)
    session.send("Performance.enable")
    visit_all(page, job, 3)
    before = counts(session)
    visit_all(page, job, 6)
    after = counts(session)
    # About the memory of one view: six leaked views would be far more.
    assert after["JSEventListeners"] <= before["JSEventListeners"] * 1.5
    assert after["Nodes"] <= before["Nodes"] * 1.5
