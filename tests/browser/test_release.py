"""The page of a release: few files, built from the sources, do what these do."""

import json
import shutil
import subprocess
from collections.abc import Iterator
from functools import partial

import httpx2
import pytest
from playwright.sync_api import Browser, Page, expect

from service.server import RunningServer, running
from service.settings import Settings
from tests.browser.conftest import ROOT, opening
from tests.browser.pictures import COVERED, tab
from tests.browser.scenes import TIMEOUT, opened, render_button, small
from tests.service.support import finish, submit

pytestmark = pytest.mark.slow

MAX_REQUESTS = 20
"""Requests of a view before it can be used, data included."""
PACKAGES = ("accuracy", "renderer", "scenes", "schemas", "service")


@pytest.fixture(scope="module")
def released(tmp_path_factory: pytest.TempPathFactory) -> Iterator[RunningServer]:
    """A service whose page is built as `make dist` builds it, from a copy of the packages."""
    modules = ROOT / "node_modules"
    if not (modules / "esbuild").exists():
        pytest.skip("The page of a release is not tested: there is no esbuild, which `make check` installs")
    root = tmp_path_factory.mktemp("release")
    for name in (*PACKAGES, "tools/web"):
        shutil.copytree(ROOT / name, root / name, ignore=shutil.ignore_patterns("__pycache__"))
    (root / "node_modules").symlink_to(modules)
    (root / "package.json").write_bytes((ROOT / "package.json").read_bytes())
    subprocess.run(["node", "tools/web/build_page.js"], cwd=root, check=True, timeout=TIMEOUT / 1000)
    settings = Settings(data=root / "data", port=0, workers=2, log_level="error")
    with running(settings, popen=partial(subprocess.Popen, cwd=root)) as started:
        yield started


def requests_of(page: Page, path: str, ready: str) -> list[str]:
    """Addresses that a view asks for until it shows an element."""
    asked: list[str] = []
    page.on("request", lambda request: asked.append(request.url))
    page.goto(path)
    expect(page.locator(ready).first).to_be_visible(timeout=TIMEOUT)
    page.wait_for_load_state("networkidle")
    return asked


def test_views_ask_for_few_files(chromium: Browser, released: RunningServer) -> None:
    with httpx2.Client(base_url=released.url, timeout=60) as client:
        job = finish(client, submit(client, json.loads(small("basic"))))["id"]
    with opening(chromium, released.url) as open_page:
        for path, ready in (("/", ".cm-content"), (f"/jobs/{job}", ".state")):
            page = open_page("/docs")
            asked = requests_of(page, path, ready)
            assert 0 < sum(address.endswith(".js") for address in asked) <= 2, asked
            assert len(asked) <= MAX_REQUESTS, asked


def test_scene_is_rendered_and_explained(chromium: Browser, released: RunningServer) -> None:
    with opening(chromium, released.url) as open_page:
        page = open_page("/")
        opened(page)
        render_button(page).click()
        page.wait_for_url("**/jobs/*", timeout=TIMEOUT)
        expect(page.locator(".state")).to_contain_text("finished", timeout=TIMEOUT)
        page.wait_for_function(COVERED)
        tab(page, "Plan")
        expect(page.locator(".stages li").first).to_be_visible(timeout=TIMEOUT)
        for view, shown in (("Jobs", "table"), ("Start", ".cm-content")):
            page.get_by_role("link", name=view, exact=True).click()
            expect(page.locator(shown).first).to_be_visible(timeout=TIMEOUT)
