"""The page of a job as a viewer: it fills the window, and nothing but its drawer scrolls or moves."""

from __future__ import annotations

import re
from typing import Any

import httpx2
import numpy as np
import pytest
from playwright.sync_api import FloatRect, Locator, Page, expect

from renderer.cameras import build_pinhole
from schemas.cameras import Camera
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
from tests.browser.scenes import TIMEOUT, endless
from tests.service.support import image, scene

SIZES = [(1280, 800), (1920, 1080), (390, 844), (360, 740)]
TABS = ("Render", "Pixel", "Plan", "Compare")
OVER = f"([x, y]) => {{{OVERLAY} return Array.from(context.getImageData(...place(x, y), 1, 1).data); }}"


def box(place: Locator) -> FloatRect:
    """Where an element is."""
    found = place.bounding_box()
    assert found is not None
    return found


def scrolled(page: Page) -> list[float]:
    """How far the page is scrolled, and how much higher than the window it is."""
    return page.evaluate(
        "(({ scrollTop, scrollHeight, clientHeight }) => [scrollTop, scrollHeight - clientHeight])"
        "(document.scrollingElement)"
    )


@pytest.fixture(scope="module")
def job(server: Any) -> str:
    with httpx2.Client(base_url=server.url, timeout=60) as client:
        return finished(client, scene() | {"name": "a name that is far too long for the toolbar " * 4})


@pytest.mark.parametrize("size", SIZES, ids=lambda size: "{} x {}".format(*size))
def test_the_viewer_fills_the_window_and_asking_scrolls_nothing(
    open_page: Open, job: str, shoot: Shoot, size: tuple[int, int]
) -> None:
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


def test_a_long_name_ends_in_dots_and_is_whole_in_its_title(open_page: Open, job: str) -> None:
    page = opened(open_page, job, width=360, height=740)
    title = page.get_by_role("heading", level=1)
    assert title.evaluate("(one) => one.scrollWidth > one.clientWidth")
    assert title.evaluate("(one) => getComputedStyle(one).textOverflow") == "ellipsis"
    expect(title).to_have_attribute("title", re.compile("^a name .* toolbar $"))


def test_the_picture_keeps_its_place_when_a_job_ends(open_page: Open, client: httpx2.Client) -> None:
    job = endless(client, "ends")
    page = open_page(f"/jobs/{job}")
    page.wait_for_function(COVERED, timeout=TIMEOUT)
    expect(page.locator(".job-progress .state")).to_have_text("▶ running", timeout=TIMEOUT)
    places = [page.locator(".screen"), page.locator(".figures"), page.get_by_role("tablist")]
    before = [box(place) for place in places]
    client.post(f"/v1/jobs/{job}/cancel")
    expect(page.locator(".job-progress .state")).to_have_text("■ cancelled", timeout=TIMEOUT)
    assert [box(place)["y"] for place in places] == [place["y"] for place in before]
    assert box(places[0]) == before[0]


def test_the_wheel_zooms_both_ways_and_never_scrolls_the_page(open_page: Open, job: str) -> None:
    page = opened(open_page, job)
    pixels = page.locator("canvas.pixels")
    before = box(pixels)
    point_at(page, 40, 24)
    page.mouse.wheel(0, 120)
    assert box(pixels)["width"] < before["width"]
    page.mouse.wheel(0, -480)
    assert box(pixels)["width"] > before["width"]
    assert scrolled(page) == [0, 0]


def test_zooming_into_a_tiny_picture_enlarges_it(open_page: Open, client: httpx2.Client) -> None:
    page = open_page(f"/jobs/{finished(client, scene(4, 3, samples=1, light_samples=1))}")
    page.wait_for_function(COVERED, timeout=TIMEOUT)
    before = box(page.locator("canvas.pixels"))
    page.get_by_role("button", name="Zoom in").click()
    assert box(page.locator("canvas.pixels"))["width"] > before["width"]


def test_one_to_one_shows_a_pixel_as_one_of_the_display(open_page: Open, job: str) -> None:
    page = opened(open_page, job)
    page.get_by_role("button", name="1:1").click()
    assert box(page.locator("canvas.pixels"))["width"] == 80
    expect(page.get_by_label("Zoom", exact=True).locator("output")).to_have_text("100 %")
    page.get_by_role("button", name="Fit").click()
    assert box(page.locator("canvas.pixels"))["width"] > 400


def test_zoom_and_centre_are_in_the_address_and_come_along_to_a_comparison(
    open_page: Open, client: httpx2.Client, job: str
) -> None:
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
    tab(page, "Compare")
    page.get_by_label("Compare with").select_option(other)
    page.get_by_role("button", name="Compare").click()
    page.wait_for_url(re.compile(rf"/compare/{job}/{other}\?zoom="), timeout=TIMEOUT)


def test_the_line_between_two_pictures_is_dragged_and_space_shows_the_second(
    open_page: Open, client: httpx2.Client, job: str
) -> None:
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


def test_the_drawer_is_used_by_keyboard_and_can_be_put_away(open_page: Open, job: str) -> None:
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


def test_the_background_is_chosen_and_kept(open_page: Open, job: str) -> None:
    page = opened(open_page, job)
    page.get_by_role("button", name="Display").click()
    page.get_by_label("Background").select_option("black")
    page.reload()
    expect(page.locator(".stage")).to_have_css("background-color", "rgb(0, 0, 0)", timeout=TIMEOUT)


def test_in_a_narrow_window_the_display_settings_are_behind_a_button(
    open_page: Open, client: httpx2.Client, job: str
) -> None:
    page = opened(open_page, job, width=360, height=740)
    expect(page.get_by_label("Exposure")).to_be_hidden()
    page.get_by_role("button", name="Display").click()
    page.get_by_label("Exposure").fill("1")
    assert codes_of(page).mean() > served(client, job).mean()


def test_a_pixel_is_copied_with_all_its_digits(open_page: Open, client: httpx2.Client, job: str) -> None:
    page = opened(open_page, job, permissions=["clipboard-read", "clipboard-write"])
    click_at(page, 40, 40)
    page.get_by_role("button", name="Copy values").click(timeout=TIMEOUT)
    expect(page.locator("#announcer")).to_have_text("The values of pixel 40, 40 are copied.")
    copied = np.array(page.evaluate("navigator.clipboard.readText()").split(), np.float32)
    np.testing.assert_array_equal(copied, image(client, job)[40, 40])


def test_a_browser_that_stores_nothing_shows_the_picture(open_page: Open, job: str) -> None:
    page = open_page("/jobs")
    for name in ("localStorage", "sessionStorage"):
        page.add_init_script(
            f"Object.defineProperty(window, '{name}', "
            "{ get() { throw new DOMException('Access is denied.', 'SecurityError'); } })"
        )
    page.goto(f"/jobs/{job}")
    page.wait_for_function(COVERED)
    page.get_by_role("button", name="Display").click()
    page.get_by_label("Background").select_option("black")
    expect(page.locator(".stage")).to_have_attribute("data-background", "black")
    page.goto("/")
    expect(page.get_by_role("button", name="Render", exact=True)).to_be_enabled()
    page.get_by_label("Labels").fill("week:3")
    page.get_by_role("link", name="Jobs", exact=True).click()
    expect(page.get_by_role("heading", level=1)).to_have_text("Jobs")


def test_what_blocks_the_light_of_a_pixel_is_highlighted(open_page: Open, job: str) -> None:
    page = opened(open_page, job)
    ball = (40, 22)
    assert page.evaluate(OVER, list(ball))[3] == 0
    click_at(page, 28, 27)
    expect(page.get_by_role("heading", name="Pixel 28, 27")).to_be_visible(timeout=TIMEOUT)
    page.wait_for_function(f"(place) => ({OVER})(place)[3] > 0", arg=list(ball))
    red, _, blue, _ = page.evaluate(OVER, list(ball))
    assert red > 2 * blue


def test_places_on_the_picture_are_those_of_the_camera(bare_page: Page) -> None:
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


@pytest.mark.parametrize("ends", [(1e-3, 70), (0.6, 9), (2.1, 4.8), (0.71, 0.93), (9.7, 10.4)])
def test_an_axis_has_round_numbers_within_its_data(bare_page: Page, ends: tuple[float, float]) -> None:
    ticks = bare_page.evaluate(
        "async ([low, high]) => (await import('/web/plots.js')).ticks(low, high)", list(ends)
    )
    assert 3 <= len(ticks) <= 12
    assert ticks == sorted(set(ticks))
    assert ends[0] <= ticks[0] < ticks[-1] <= ends[1]
