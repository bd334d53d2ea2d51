"""Accessibility of every view by axe, light on a wide screen and dark on a narrow one."""

import json
from pathlib import Path
from typing import Any, Literal

import httpx2
import pytest
from playwright.sync_api import Page, expect

from tests.browser.conftest import Open, Shoot
from tests.browser.pictures import COVERED, click_at, tab
from tests.browser.scenes import TIMEOUT, editor, opened, small, write
from tests.service.support import finish, submit

AXE = (Path(__file__).parent / "vendor" / "axe-core" / "axe.min.js").read_text()
RUN = "async () => (await axe.run(document, { resultTypes: ['violations'] })).violations"
GRAVE = {"serious", "critical"}
OVERFLOW = "document.documentElement.scrollWidth - window.innerWidth"
THIN_OUT = "[...document.querySelectorAll('section')].forEach((one, at) => at % 8 && one.remove())"
SCHEMES: tuple[Literal["light", "dark"], ...] = ("light", "dark")
# Width and height of a window on a desk and of a telephone, pixels.
SIZES = {"wide": (1200, 900), "narrow": (360, 740)}


@pytest.fixture(scope="module")
def jobs(server: Any) -> list[str]:
    """Two jobs, of which the errors are known."""
    random = {"pattern": "random", "samples": 16}
    quality = {"mode": "fixed", "antialiasing": random, "light": random}
    with httpx2.Client(base_url=server.url, timeout=60) as client:
        made = [submit(client, json.loads(small("basic", name=name)), quality=quality) for name in ("a", "b")]
        for job in made:
            finish(client, job)
    return made


def start(page: Page, _jobs: list[str]) -> None:
    opened(page)


def start_with_mistakes(page: Page, _jobs: list[str]) -> None:
    opened(page)
    write(page, small("basic").replace('"cobalt"', '"cobald"', 1).replace('"version": 1', '"version": 2'))
    expect(page.locator(".line.wrong").first).to_be_visible(timeout=TIMEOUT)


def start_completing(page: Page, _jobs: list[str]) -> None:
    opened(page)
    write(page, '{"camera": {')
    editor(page).press("Control+End")
    page.keyboard.type('"')
    expect(page.get_by_role("option", selected=True)).to_be_visible(timeout=TIMEOUT)


def listed(page: Page, jobs: list[str]) -> None:
    for job in jobs:
        expect(page.locator(f'a.name[href="/jobs/{job}"]')).to_be_visible(timeout=TIMEOUT)


def one_job(page: Page, _jobs: list[str]) -> None:
    page.wait_for_function(COVERED)
    expect(page.locator(".plot svg")).to_be_visible(timeout=TIMEOUT)


def one_pixel(page: Page, _jobs: list[str]) -> None:
    page.wait_for_function(COVERED)
    click_at(page, 9, 20, (32, 32))
    expect(page.get_by_role("heading", name="Pixel 9, 20")).to_be_visible(timeout=TIMEOUT)


def one_plan(page: Page, _jobs: list[str]) -> None:
    tab(page, "Plan")
    expect(page.locator(".stages li").first).to_be_visible(timeout=TIMEOUT)


def one_other(page: Page, _jobs: list[str]) -> None:
    tab(page, "Compare")
    expect(page.get_by_label("Compare with")).to_be_visible(timeout=TIMEOUT)


def compared(page: Page, _jobs: list[str]) -> None:
    expect(page.get_by_role("heading", level=1)).to_be_visible(timeout=TIMEOUT)
    page.wait_for_load_state("networkidle")


def service(page: Page, _jobs: list[str]) -> None:
    expect(page.get_by_role("row").filter(has_text="idle")).to_have_count(2, timeout=TIMEOUT)
    expect(page.get_by_role("row").filter(has_text="local")).to_contain_text("CPU s")
    expect(page.get_by_role("link", name="Service")).to_be_visible()


def nothing(page: Page, _jobs: list[str]) -> None:
    expect(page.get_by_role("heading", level=1)).to_be_visible()


def reference(page: Page, jobs: list[str]) -> None:
    """Every eighth section of a long page: all are made alike, and all fit."""
    nothing(page, jobs)
    width, height = SIZES["narrow"]
    page.set_viewport_size({"width": width, "height": height})
    assert page.evaluate(OVERFLOW) <= 0
    page.evaluate(THIN_OUT)


VIEWS = {
    "start": ("/", start),
    "mistakes": ("/", start_with_mistakes),
    "completion": ("/", start_completing),
    "jobs": ("/jobs", listed),
    "job": ("/jobs/{0}", one_job),
    "job-pixel": ("/jobs/{0}", one_pixel),
    "job-plan": ("/jobs/{0}", one_plan),
    "job-compare": ("/jobs/{0}", one_other),
    "compare": ("/compare/{0}/{1}", compared),
    "service": ("/service", service),
    "missing": ("/compare", nothing),
    "reference": ("/docs", reference),
}


@pytest.mark.slow
@pytest.mark.parametrize("view", VIEWS)
def test_axe_finds_nothing_grave(open_page: Open, shoot: Shoot, jobs: list[str], view: str) -> None:
    path, ready = VIEWS[view]
    page = open_page(path.format(*jobs))
    ready(page, jobs)
    page.evaluate(AXE)
    for scheme, (size, (width, height)) in zip(SCHEMES, SIZES.items(), strict=True):
        page.emulate_media(color_scheme=scheme)
        page.set_viewport_size({"width": width, "height": height})
        shoot(page, f"{view}-{scheme}-{size}")
        assert grave(page) == []
        assert page.evaluate(OVERFLOW) <= 0


def grave(page: Page) -> list[str]:
    """Serious findings of axe: the rule, the elements, and the cure."""
    return [
        f"{found['id']}: {[node['html'] for node in found['nodes']]} {found['nodes'][0]['failureSummary']}"
        for found in page.evaluate(RUN)
        if found["impact"] in GRAVE
    ]
