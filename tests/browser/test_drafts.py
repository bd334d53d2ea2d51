"""Drafts: what is written on the start page survives reloads, and a job is sent again as it was."""

import json
import re
from typing import Any

import httpx2
import pytest
from playwright.sync_api import Page, expect

from tests.browser.conftest import Open
from tests.browser.scenes import (
    GALLERY,
    TIMEOUT,
    ask_for_samples,
    choose,
    drop,
    expect_written,
    opened,
    render_button,
    small,
    write,
)
from tests.service.support import submit

TILES = (GALLERY / "textures" / "tiles.png").read_bytes()


@pytest.mark.slow
def test_text_survives_a_reload(page: Page) -> None:
    opened(page)
    text = small("basic", name="not lost")
    write(page, text)
    ask_for_samples(page, 9, 3)
    page.get_by_label("Labels").fill("week:3")
    page.get_by_label("Keep layers").uncheck()
    opened(page)
    page.reload()
    expect_written(page, text)
    expect(page.get_by_label("Samples per pixel")).to_have_value("9")
    expect(page.get_by_label("Labels")).to_have_value("week:3")
    expect(page.get_by_label("Keep layers")).not_to_be_checked()
    heading = page.get_by_role("heading", level=1)
    expect(heading).to_have_text("not lost")
    expect(page.locator(".notice")).to_be_hidden()
    drop(page, other__json=small("basic").encode())
    page.get_by_role("dialog").get_by_role("button", name="Replace it").click()
    expect(heading).to_have_text("other.json")
    expect(page.get_by_label("Labels")).to_have_value("")
    page.get_by_role("button", name="Undo").click()
    expect(page.get_by_label("Labels")).to_have_value("week:3")


@pytest.mark.slow
def test_each_address_has_its_draft(open_page: Open, client: httpx2.Client) -> None:
    """A changed job and what is written on the start page do not take each other's place."""
    page = open_page("/")
    opened(page)
    own, changed = small("basic", name="my own"), small("basic", name="changed")
    write(page, own)
    opened(page)
    page.goto(f"/?job={submit(client, json.loads(small('basic')))}")
    opened(page)
    write(page, changed)
    opened(page)
    page.goto("/")
    expect_written(page, own)
    page.go_back()
    expect_written(page, changed)


@pytest.mark.slow
def test_scene_that_was_replaced_is_a_recent_one(page: Page) -> None:
    opened(page)
    drop(page, mine__json=small().encode(), tiles__png=TILES)
    opened(page)
    choose(page, "Falloff")
    expect(page.get_by_role("heading", level=1)).to_have_text("Falloff", timeout=TIMEOUT)
    opened(page)
    page.reload()
    opened(page)
    page.get_by_role("button", name="Open a scene").click()
    expect(page.locator(".recent li")).to_have_count(1)
    page.get_by_role("button", name="mine.json").click()
    expect_written(page, small())
    expect(page.locator(".files li")).to_contain_text("here", timeout=TIMEOUT)
    opened(page)


@pytest.mark.slow
def test_uploaded_file_survives_a_reload(page: Page) -> None:
    opened(page)
    drop(page, mine__json=small().encode(), tiles__png=TILES)
    texture = page.locator(".files li").filter(has_text="textures/tiles.png")
    expect(texture).to_contain_text("here", timeout=TIMEOUT)
    opened(page)
    page.reload()
    expect(texture).to_contain_text("here", timeout=TIMEOUT)
    opened(page)


@pytest.mark.slow
def test_scene_for_which_a_tab_has_no_room_survives_a_reload(page: Page) -> None:
    opened(page)
    page.evaluate(
        """() => {
          sessionStorage.clear();
          for (let size = 1 << 22; size >= 256; size /= 2)
            try {
              for (let i = 0; ; i++) sessionStorage.setItem(`ballast ${size} ${i}`, "x".repeat(size));
            } catch {}
        }"""
    )
    large = small("basic", name="no room", description="x" * 2000)
    write(page, large)
    page.wait_for_timeout(1000)
    assert "no room" not in str(page.evaluate("JSON.stringify(sessionStorage).replace(/x+/g, 'x')"))
    page.reload()
    expect_written(page, large)


@pytest.mark.slow
@pytest.mark.parametrize(
    "quality",
    [
        {"mode": "fixed", "light": {"pattern": "random", "samples": 3}},
        {"mode": "target", "error": 0.01, "time_limit": 30.0},
        {"mode": "target", "error": 0.01},
        {"mode": "fixed", "antialiasing": {"pattern": "sobol", "samples": 2}, "precision": "double"},
    ],
    ids=["light alone", "error and limit", "hundredth", "camera alone"],
)
def test_unchanged_job_is_sent_as_it_was(
    open_page: Open, client: httpx2.Client, quality: dict[str, Any]
) -> None:
    rest = {
        "quality": quality,
        "priority": 3,
        "time_limit": 120.5,
        "layers": ["depth"],
        "labels": {"week": "3", "ball": ""},
    }
    job = submit(client, json.loads(small("basic", name="as it was")), **rest)
    page = open_page(f"/?job={job}")
    opened(page)
    expect(page.get_by_label("Labels")).to_have_value(re.compile(r"ball(,|$)"))
    render_button(page).click()
    expect(page.get_by_role("heading", level=1)).to_have_text("as it was", timeout=TIMEOUT)
    expect(page).to_have_url(re.compile(r"/jobs/(?!" + job + ")"))
    before, after = (
        client.get(f"/v1/jobs/{each}/request").json() for each in (job, page.url.rsplit("/", 1)[1])
    )
    assert after == before


@pytest.mark.slow
def test_changed_scene_survives_a_reload(open_page: Open, client: httpx2.Client) -> None:
    job = submit(client, json.loads(small("basic")))
    page = open_page(f"/?job={job}")
    opened(page)
    write(page, small("basic", name="changed"))
    opened(page)
    page.reload()
    expect_written(page, small("basic", name="changed"))
