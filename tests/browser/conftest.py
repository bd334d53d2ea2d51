"""The live page in Debian's Chromium, before a real server; one browser and one server for all tests."""

import asyncio
import re
import shutil
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import httpx2
import pytest
from playwright.sync_api import Browser, ConsoleMessage, Page, Request, expect, sync_playwright

from service.server import RunningServer
from service.settings import Settings
from tests.browser.scenes import TIMEOUT
from tests.service.forking import running

# The default of 5 seconds is too short for a machine with other work.
expect.set_options(timeout=TIMEOUT)

ROOT = Path(__file__).parents[2]
SCREENSHOTS = ROOT / "out" / "screenshots"
# Expected: refusals, such as the problems of a scene, requests of a page without a network, and that a test
# reads back what a shader has drawn.
REFUSED = re.compile(
    r"Failed to load resource: (the server responded with a status of 4\d\d|net::ERR_INTERNET_DISCONNECTED)"
    r"|\[\.WebGL-\w+\].* GPU stall due to ReadPixels"
)

BROWSERS = ("chromium-headless-shell", "chromium", "chromium-browser")
"""The first has no windows to set up for each page: a page takes a third of the processor time."""

Open = Callable[..., Page]
Shoot = Callable[[Page, str], Path]


@pytest.fixture(scope="session")
def launched() -> Iterator[tuple[Browser, asyncio.AbstractEventLoop]]:
    """The browser, and the event loop of Playwright."""
    path = next(filter(None, map(shutil.which, BROWSERS)), None)
    if path is None:
        pytest.skip(
            "There is no chromium on this machine, so the live page is not tested: "
            "install chromium-headless-shell"
        )
    with sync_playwright() as playwright:
        # Containers seldom allow the sandbox, and the tests open nothing but the service's own page.
        browser = playwright.chromium.launch(executable_path=path, args=["--no-sandbox"])
        loop = asyncio.get_running_loop()
        _mark_running(None)
        yield browser, loop
        _mark_running(loop)
        browser.close()


def _mark_running(loop: asyncio.AbstractEventLoop | None) -> None:
    # For authors of event loops; Playwright uses it to leave and to enter its own.
    asyncio._set_running_loop(loop)  # noqa: SLF001


@pytest.fixture(scope="module")
def chromium(launched: tuple[Browser, asyncio.AbstractEventLoop]) -> Iterator[Browser]:
    """The browser, as long as tests of the page run.

    Between two calls Playwright leaves its event loop marked as the running one of this thread, although it
    waits; tests elsewhere run loops of their own.
    """
    browser, loop = launched
    _mark_running(loop)
    yield browser
    _mark_running(None)


@pytest.fixture(scope="session")
def server(tmp_path_factory: pytest.TempPathFactory) -> Iterator[RunningServer]:
    settings = Settings(
        data=tmp_path_factory.mktemp("service"), port=0, workers=2, log_level="error", max_wait_seconds=20
    )
    with running(settings) as started:
        yield started


@pytest.fixture
def client(server: RunningServer) -> Iterator[httpx2.Client]:
    with httpx2.Client(base_url=server.url, timeout=60) as opened:
        yield opened


@contextmanager
def opening(chromium: Browser, url: str) -> Iterator[Open]:
    """Open pages of the service; none may report an error, break the policy, or ask another host."""
    complaints: list[str] = []
    contexts = []

    def heard(message: ConsoleMessage) -> None:
        if message.type in {"error", "warning"} and not REFUSED.match(message.text):
            complaints.append(f"{message.type}: {message.text}")

    def asked(request: Request) -> None:
        if not request.url.startswith((url, "blob:", "data:")):
            complaints.append(f"asked another host: {request.url}")

    def begin(path: str = "/", *, width: int = 1200, height: int = 900, **options: Any) -> Page:
        context = chromium.new_context(
            base_url=url, viewport={"width": width, "height": height}, reduced_motion="reduce", **options
        )
        context.set_default_timeout(TIMEOUT)
        contexts.append(context)
        page = context.new_page()
        page.on("console", heard)
        page.on("pageerror", lambda error: complaints.append(f"exception: {error}"))
        page.on("request", asked)
        page.goto(path)
        return page

    yield begin
    for context in contexts:
        context.close()
    assert complaints == []


@pytest.fixture
def open_page(chromium: Browser, server: RunningServer) -> Iterator[Open]:
    """Open pages that are closed with the test."""
    with opening(chromium, server.url) as begin:
        yield begin


@pytest.fixture(scope="module")
def bare_page(chromium: Browser, server: RunningServer) -> Iterator[Page]:
    """A page that asks the service for nothing, in which scripts of the page are tried."""
    with opening(chromium, server.url) as begin:
        yield begin("/compare")


@pytest.fixture
def page(open_page: Open) -> Page:
    """The page as it starts, on a screen of usual size."""
    return open_page("/")


@pytest.fixture
def shoot() -> Shoot:
    """Save a screenshot of a page for people to inspect."""

    def save(page: Page, name: str) -> Path:
        SCREENSHOTS.mkdir(parents=True, exist_ok=True)
        path = SCREENSHOTS / f"{name}.png"
        page.screenshot(path=path, full_page=True)
        return path

    return save
