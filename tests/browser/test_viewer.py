"""The page of a job as a viewer: it fills the window, and nothing but its drawer scrolls or moves."""

import re
from typing import Any

import httpx2
import numpy as np
import pytest
from playwright.sync_api import FloatRect, Locator, Page, expect

from renderer.cameras import build_pinhole
from renderer.images import files as image_files
from schemas.cameras import Camera
from schemas.scene import Display
from tests.browser.conftest import Open, Shoot
from tests.browser.pictures import (
    COVERED,
    OVERLAY,
    click_at,
    codes_of,
    finished,
    opened,
    point_at,
    served,
    tab,
)
from tests.browser.scenes import TIMEOUT
from tests.service.support import image, scene

SIZES = [(1280, 800), (1920, 1080), (390, 844), (360, 740)]
TABS = ("Render", "Pixel", "Plan", "Compare")
OVER = f"([x, y]) => {{{OVERLAY} return Array.from(context.getImageData(...place(x, y), 1, 1).data); }}"


def box(place: Locator) -> FloatRect:
    """The bounding box of an element."""
    found = place.bounding_box()
    assert found is not None
    return found


def scrolled(page: Page) -> list[float]:
    """The scroll position of the page, and its height beyond the window."""
    return page.evaluate(
        "(({ scrollTop, scrollHeight, clientHeight }) => [scrollTop, scrollHeight - clientHeight])"
        "(document.scrollingElement)"
    )


@pytest.fixture(scope="module")
def job(server: Any) -> str:
    with httpx2.Client(base_url=server.url, timeout=60) as client:
        return finished(client, scene() | {"name": "a name that is far too long for the toolbar " * 4})


@pytest.mark.slow
@pytest.mark.parametrize("size", SIZES, ids=lambda size: "{} x {}".format(*size))
def test_viewer_fills_the_window(open_page: Open, job: str, shoot: Shoot, size: tuple[int, int]) -> None:
    width, height = size
    page = opened(open_page, job, width=width, height=height)
    screen = page.locator(".screen")
    before = box(screen)
    assert (before["x"], before["y"] + before["height"]) <= (0, height)
    for name in TABS:
        tab(page, name)
        panel = page.get_by_role("tabpanel", name=name)
        expect(panel).to_be_in_viewport(ratio=1)
        assert box(screen) == before
        assert scrolled(page) == [0, 0]
        assert page.evaluate("document.documentElement.scrollWidth") <= width
    click_at(page, 30, 20)
    expect(page.get_by_role("heading", name="Pixel 30, 20")).to_be_in_viewport(timeout=TIMEOUT)
    expect(page.locator(".readout")).to_be_in_viewport(ratio=1)
    assert box(screen) == before
    shoot(page, f"viewer-{width}")


@pytest.mark.slow
def test_wheel_never_scrolls_the_page(open_page: Open, job: str) -> None:
    page = opened(open_page, job)
    pixels = page.locator("canvas.pixels")
    before = box(pixels)
    point_at(page, 40, 24)
    page.mouse.wheel(0, 120)
    assert box(pixels)["width"] < before["width"]
    page.mouse.wheel(0, -480)
    assert box(pixels)["width"] > before["width"]
    assert scrolled(page) == [0, 0]


@pytest.mark.slow
def test_zoom_is_in_the_address(open_page: Open, client: httpx2.Client, job: str) -> None:
    other = finished(client, scene() | {"shapes": scene()["shapes"][:1]})
    page = opened(open_page, job)
    point_at(page, 20, 30)
    page.mouse.wheel(0, -600)
    page.wait_for_url(re.compile(r"zoom=.*&x=.*&y="), timeout=TIMEOUT)
    there = box(page.locator("canvas.pixels"))
    again = opened(open_page, page.url.rpartition("/")[2])
    for side, value in box(again.locator("canvas.pixels")).items():
        assert value == pytest.approx(there[side], abs=1)
    again.get_by_role("button", name="Fit").click()
    again.wait_for_url(re.compile(r"/jobs/\w+$"), timeout=TIMEOUT)
    page.get_by_label("Exposure", exact=True).fill("2")
    page.get_by_role("button", name="Display").click()
    page.get_by_label("Channel").select_option("red")
    tab(page, "Compare")
    page.get_by_label("Compare with").select_option(other)
    page.get_by_role("button", name="Compare").click()
    page.wait_for_url(re.compile(rf"/compare/{job}/{other}\?.*zoom="), timeout=TIMEOUT)
    expect(page.locator(".verdict")).to_be_visible(timeout=TIMEOUT)
    expect(page.get_by_label("Exposure", exact=True)).to_have_value("2")
    expect(page.locator("#shown-channel")).to_have_value("red")


@pytest.mark.slow
def test_line_is_dragged(open_page: Open, client: httpx2.Client, job: str) -> None:
    other = finished(client, scene() | {"shapes": scene()["shapes"][:1]})
    page = open_page(f"/compare/{job}/{other}")
    expect(page.locator(".verdict")).to_be_visible(timeout=TIMEOUT)
    one, two = served(client, job), served(client, other)
    pixels = box(page.locator("canvas.pixels"))
    column = pixels["width"] / 80
    y = pixels["y"] + pixels["height"] / 2
    page.mouse.move(pixels["x"] + 40 * column, y)
    page.mouse.down()
    page.mouse.move(pixels["x"] + 20 * column, y, steps=3)
    page.mouse.up()
    np.testing.assert_array_equal(codes_of(page), np.hstack([one[:, :20], two[:, 20:]]))
    page.keyboard.down(" ")
    np.testing.assert_array_equal(codes_of(page), two)
    page.keyboard.up(" ")
    np.testing.assert_array_equal(codes_of(page), np.hstack([one[:, :20], two[:, 20:]]))
    page.wait_for_url("**line=2*", timeout=TIMEOUT)
    page.reload()
    expect(page.locator(".verdict")).to_be_visible(timeout=TIMEOUT)
    np.testing.assert_array_equal(codes_of(page), np.hstack([one[:, :20], two[:, 20:]]))


@pytest.mark.slow
def test_drawer_by_keyboard(open_page: Open, job: str) -> None:
    page = opened(open_page, job)
    page.get_by_role("tab", name="Render").focus()
    page.keyboard.press("ArrowRight")
    expect(page.get_by_role("tab", name="Pixel")).to_be_focused()
    expect(page.get_by_role("tabpanel", name="Pixel")).to_be_visible()
    page.get_by_role("button", name="Panel").click()
    expect(page.get_by_role("tabpanel")).to_have_count(0)
    assert box(page.locator(".screen"))["width"] == 1200
    # A question opens it.
    click_at(page, 30, 20)
    expect(page.get_by_role("heading", name="Pixel 30, 20")).to_be_visible(timeout=TIMEOUT)


@pytest.mark.slow
def test_blocker_is_highlighted(open_page: Open, job: str) -> None:
    page = opened(open_page, job)
    ball = (40, 22)
    assert page.evaluate(OVER, list(ball))[3] == 0
    click_at(page, 28, 27)
    expect(page.get_by_role("heading", name="Pixel 28, 27")).to_be_visible(timeout=TIMEOUT)
    page.wait_for_function(f"(place) => ({OVER})(place)[3] > 0", arg=list(ball))
    red, _, blue, _ = page.evaluate(OVER, list(ball))
    assert red > 2 * blue


@pytest.mark.slow
def test_places_of_the_camera(bare_page: Page) -> None:
    camera = {"position": [1, 2, 6], "look_at": [0, 0.5, -1], "up": [0.2, 1, 0], "vertical_fov": 37}
    sides = {"width": 80, "height": 48}
    pinhole = build_pinhole(Camera.model_validate(camera | sides))
    random = np.random.default_rng(3)
    x, y, far = random.uniform(0, 80, 50), random.uniform(0, 48, 50), random.uniform(0.5, 20, 50)
    points = pinhole.position + far * pinhole.directions(x, y)
    found = bare_page.evaluate(
        """async ([camera, points]) => {
            const { Projection } = await import("/web/views/picture/projection.js");
            const projection = new Projection(camera);
            return points.map((point) => projection.place(point)).map(({ x, y }) => [x, y]);
        }""",
        [camera | sides, points.T.tolist()],
    )
    # A few roundings of coordinates up to 80 pixels.
    np.testing.assert_allclose(found, np.stack([x, y], axis=1), atol=1e-10, rtol=0)


@pytest.mark.slow
def test_link_opens_what_is_shown(open_page: Open, client: httpx2.Client) -> None:
    layered = finished(client, layers=["depth"])
    page = opened(open_page, layered, permissions=["clipboard-read", "clipboard-write"])
    page.get_by_label("Exposure", exact=True).fill("2")
    page.get_by_role("button", name="Display").click()
    page.get_by_label("Channel").select_option("green")
    page.keyboard.press("Escape")
    # Near an edge of what is shown, so that a smaller window must move to show it.
    click_at(page, 70, 40)
    point_at(page, 40, 24)
    page.mouse.wheel(0, -150)
    tab(page, "Plan")
    page.get_by_role("button", name="Copy link").click()
    expect(page.locator("#announcer")).to_have_text("The link is copied.")
    link = page.evaluate("navigator.clipboard.readText()")
    phone = open_page(link, width=390, height=844, has_touch=True)
    expect(phone.get_by_role("tab", name="Plan")).to_have_attribute("aria-selected", "true")
    phone.wait_for_function(COVERED)
    screen, pixels = box(phone.locator(".screen")), box(phone.locator("canvas.pixels"))
    side = pixels["width"] / 80
    # To a dot.
    assert screen["x"] <= pixels["x"] + 70 * side <= screen["x"] + screen["width"] - side + 1
    assert screen["y"] <= pixels["y"] + 40 * side <= screen["y"] + screen["height"] - side + 1
    shown = image_files.displayed(image(client, layered)[..., 1], Display(exposure=2))
    np.testing.assert_array_equal(codes_of(phone), shown[..., None].repeat(3, axis=2))
    tab(phone, "Pixel")
    expect(phone.get_by_role("heading", name="Pixel 70, 40")).to_be_visible()
    page.get_by_label("Shown").select_option("depth")
    page.wait_for_url(re.compile("layer=depth"))
    page.reload()
    expect(page.locator(".legend")).to_contain_text("depth")


@pytest.mark.slow
@pytest.mark.parametrize("width", [961, 1280])
def test_toolbar_is_complete(open_page: Open, client: httpx2.Client, width: int) -> None:
    layered = finished(client, scene() | {"name": "a long name " * 9}, layers=["depth", "shading_normal"])
    page = opened(open_page, layered, width=width, height=700)
    for one in page.locator(".bar-top :is(button, select, input)").all():
        if one.is_visible():
            expect(one).to_be_in_viewport(ratio=1)
    for name in ("Shown", "Exposure", "Transfer", "Copy link", "Full screen"):
        expect(page.get_by_label(name, exact=True)).to_be_in_viewport(ratio=1)
    assert box(page.locator(".bar-top h1"))["width"] >= 48


@pytest.mark.slow
@pytest.mark.parametrize(
    "size", [(390, 844), (844, 390), (640, 400)], ids=["phone", "phone on its side", "at 200 %"]
)
def test_picture_has_half_of_a_small_window(open_page: Open, job: str, size: tuple[int, int]) -> None:
    width, height = size
    page = opened(open_page, job, width=width, height=height)
    stage = box(page.locator(".stage"))
    assert stage["width"] * stage["height"] >= width * height / 2
    assert scrolled(page) == [0, 0]
    for one in (*page.get_by_role("tab").all(), page.get_by_role("button", name="Panel")):
        expect(one).to_be_in_viewport(ratio=1)
    click_at(page, 30, 20)
    expect(page.get_by_role("heading", name="Pixel 30, 20")).to_be_in_viewport(timeout=TIMEOUT)
