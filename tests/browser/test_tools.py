"""Tools that look at the picture: histogram, exposure, channels, clipping, statistics, scales."""

import io

import httpx2
import numpy as np
import pytest
from playwright.sync_api import Page, expect

from renderer.images import files as image_files
from schemas.scene import Display
from service.server import RunningServer
from tests.browser.conftest import Open
from tests.browser.pictures import OVERLAY, click_at, codes_of, finished, opened, point_at, served, tab
from tests.service.support import image, scene

# Whether each pixel has a mark, which is red with dark stripes; null for one out of sight.
MARKED = f"""(places) => {{{OVERLAY}
    return places.map(([x, y]) => {{
        // Between the frame of the cursor and the numbers in the middle.
        const [left, top] = place(x + 0.5, y + 0.27);
        if (left < 0 || top < 0 || left >= over.width || top >= over.height) return null;
        const [red, green, blue, alpha] = context.getImageData(left, top, 1, 1).data;
        return alpha === 255 && red > 100 && green === 0 && blue === 0;
    }});
}}"""
# How many dots of what lies over the picture are drawn on.
DRAWN = f"""() => {{{OVERLAY}
    const {{ data }} = context.getImageData(0, 0, over.width, over.height);
    return data.filter((code, i) => i % 4 === 3 && code).length;
}}"""
LUMA = [0.2126, 0.7152, 0.0722]


@pytest.fixture(scope="module")
def bright(server: RunningServer) -> str:
    """A job whose picture is brighter than white in places."""
    with httpx2.Client(base_url=server.url, timeout=60) as client:
        lit = scene(60, 40, samples=1, light_samples=1) | {"ambient": [12, 12, 12]}
        return finished(client, lit, layers=["depth"])


def settings(page: Page) -> None:
    page.get_by_role("button", name="Display").click()


@pytest.mark.slow
def test_one_channel_is_grey(open_page: Open, client: httpx2.Client, bright: str) -> None:
    page = opened(open_page, bright)
    settings(page)
    page.get_by_label("Channel").select_option("green")
    expected = served(client, bright)[..., 1:2]
    np.testing.assert_array_equal(codes_of(page), expected.repeat(3, axis=2))
    page.get_by_label("Channel").select_option("luminance")
    luminance = (image(client, bright).astype(np.float64) @ LUMA).astype(np.float32)
    codes = image_files.displayed(luminance, Display())
    np.testing.assert_array_equal(codes_of(page), codes[..., None].repeat(3, axis=2))


@pytest.mark.slow
@pytest.mark.parametrize("notches", [0, 10], ids=["fitted", "close"])
def test_every_clipped_pixel_is_marked(
    open_page: Open, client: httpx2.Client, bright: str, notches: int
) -> None:
    page = opened(open_page, bright)
    settings(page)
    page.get_by_label("Mark clipped pixels").check()
    # The box is beside its text.
    assert page.get_by_label("Mark clipped pixels").evaluate("(box) => box.clientWidth") < 20
    page.keyboard.press("Escape")
    clipped = (image(client, bright) > 1).any(axis=2)
    # At an edge of what is clipped.
    y, x = np.argwhere(clipped[:, 1:] & ~clipped[:, :-1])[0].tolist()
    point_at(page, x, y, (60, 40))
    page.mouse.wheel(0, -120 * notches)
    page.wait_for_function(f"(places) => ({MARKED})(places)[0] !== null", arg=[[x, y]])
    places = [(x, y) for y in range(40) for x in range(60)]
    seen = {
        (bool(clipped[y, x]), found)
        for (x, y), found in zip(places, page.evaluate(MARKED, places), strict=True)
        if found is not None
    }
    assert seen == {(True, True), (False, False)}
    np.testing.assert_array_equal(codes_of(page), served(client, bright))


@pytest.mark.slow
def test_exposure_changes_the_codes(open_page: Open, bright: str) -> None:
    page = opened(open_page, bright)
    point_at(page, 30, 20, (60, 40))
    readout = page.locator(".readout")
    linear = readout.inner_text().split("shown")[0]
    page.get_by_label("Exposure", exact=True).fill("-10")
    # So dark, values lie on the straight part of sRGB.
    codes = [round(255 * 12.92 * float(value) / 2**10) for value in linear.split()[-3:]]
    expect(readout).to_have_text(linear + "shown {}  {}  {}".format(*codes))
    swatch = page.locator(".swatch").evaluate("(one) => getComputedStyle(one).backgroundColor")
    assert swatch == "rgb({}, {}, {})".format(*codes)


@pytest.mark.slow
def test_statistics_of_a_part(open_page: Open, client: httpx2.Client, bright: str) -> None:
    page = opened(open_page, bright)
    tab(page, "Pixel")
    box = page.locator("canvas.pixels").bounding_box()
    assert box is not None
    scale = box["width"] / 60
    page.keyboard.down("Shift")
    page.mouse.move(box["x"] + 30.5 * scale, box["y"] + 35.5 * scale)
    page.mouse.down()
    page.mouse.move(box["x"] + 10.5 * scale, box["y"] + 5.5 * scale, steps=3)
    page.mouse.up()
    page.keyboard.up("Shift")
    table = page.locator(".statistics table")
    expect(table).to_contain_text("Columns 10 to 30, rows 5 to 35: 21 × 31 pixels")
    part = image(client, bright)[5:36, 10:31].astype(np.float64)
    green = [number(text) for text in table.locator("tbody tr").nth(1).locator("td").all_inner_texts()]
    channel = part[..., 1]
    expected = [channel.mean(), channel.min(), channel.max(), channel.var()]
    # The table shows four digits.
    np.testing.assert_allclose(green, expected, rtol=1e-3)
    # Dragging with Shift neither chooses a pixel nor moves the picture.
    assert page.locator("canvas.pixels").bounding_box() == box
    expect(page.get_by_role("heading", name="Why this colour?")).to_be_visible()


def number(text: str) -> float:
    return float(text.replace("\N{MINUS SIGN}", "-"))


@pytest.mark.slow
def test_scale_of_a_layer(open_page: Open, client: httpx2.Client, bright: str) -> None:
    page = opened(open_page, bright)
    page.get_by_label("Shown").select_option("depth")
    before = codes_of(page) if page.get_by_label("Lowest value").input_value() else None
    page.get_by_label("Colours").select_option("grey")
    page.get_by_label("Highest value").fill("5")
    page.get_by_label("Highest value").press("Enter")
    codes = codes_of(page)
    assert before is not None
    assert (codes[..., 0] == codes[..., 1]).all()
    depth = np.load(io.BytesIO(client.get(f"/v1/jobs/{bright}/layers/depth.npy").content))
    far = np.isfinite(depth) & (depth >= 5)
    assert (codes[far] == 255).all()
    low = float(page.get_by_label("Lowest value").input_value())
    # A range without values is refused: the field goes back.
    page.get_by_label("Highest value").fill(str(low - 1))
    page.get_by_label("Highest value").press("Enter")
    expect(page.get_by_label("Highest value")).to_have_value("5")
    page.get_by_label("logarithmic").check()
    near = np.isfinite(depth) & (depth < 5)
    share = np.log(depth[near] / depth[near].min()) / np.log(5 / depth[near].min())
    assert np.abs(codes_of(page)[near][:, 0] - 255 * share).max() <= 1


@pytest.mark.slow
def test_tools_belong_to_the_layer(open_page: Open, client: httpx2.Client, bright: str) -> None:
    page = opened(open_page, bright)
    page.get_by_label("Shown").select_option("depth")
    expect(page.get_by_label("Lowest value")).to_be_visible()
    low, high = (page.get_by_label(f"{end} value").input_value() for end in ("Lowest", "Highest"))
    tab(page, "Pixel")
    depth = np.load(io.BytesIO(client.get(f"/v1/jobs/{bright}/layers/depth.npy").content))
    missing = int((~np.isfinite(depth)).sum())
    assert 0 < missing < depth.size
    caption = page.locator(".histogram-figure figcaption")
    expect(caption).to_contain_text(f"depth from {low} to {high}")
    expect(caption).to_contain_text(f"{missing} values are not finite")
    page.get_by_role("button", name="All of it").click()
    expect(page.locator(".statistics caption")).to_contain_text(f"{missing:,} values left out as infinite")
    settings(page)
    assert page.get_by_label("Channel").evaluate("(one) => one.closest('[inert]') !== null")
    page.keyboard.press("Escape")
    page.get_by_label("Shown").select_option("Picture")
    expect(caption).to_contain_text("display white")


@pytest.mark.slow
def test_region_and_lines_are_removed(open_page: Open, bright: str) -> None:
    page = opened(open_page, bright)
    point_at(page, 25, 30, (60, 40))
    expect(page.locator(".readout")).to_be_visible()
    empty = page.evaluate(DRAWN)
    click_at(page, 25, 30, (60, 40))
    expect(page.get_by_role("heading", name="Pixel 25, 30")).to_be_visible()
    page.evaluate("() => new Promise((done) => requestAnimationFrame(() => requestAnimationFrame(done)))")
    lines = page.evaluate(DRAWN)
    tab(page, "Compare")
    page.wait_for_function(f"(lines) => ({DRAWN})() < lines", arg=lines)
    tab(page, "Pixel")
    page.wait_for_function(f"(lines) => ({DRAWN})() === lines", arg=lines)
    page.get_by_role("button", name="All of it").click()
    page.wait_for_function(f"(empty) => ({DRAWN})() > empty", arg=empty)
    page.get_by_role("button", name="Remove", exact=True).click()
    page.get_by_role("button", name="Remove lines").click()
    expect(page.get_by_role("heading", name="Why this colour?")).to_be_visible()
    page.wait_for_function(f"(empty) => ({DRAWN})() === empty", arg=empty)
    click_at(page, 25, 30, (60, 40))
    page.locator(".screen").press("Escape")
    expect(page.get_by_role("heading", name="Why this colour?")).to_be_visible()


@pytest.mark.slow
def test_forced_colours_have_borders(open_page: Open, bright: str) -> None:
    page = opened(open_page, bright, forced_colors="active")
    click_at(page, 25, 30, (60, 40))
    expect(page.locator(".amount-fill").first).to_be_visible()
    for place in (".amount-fill", ".drawer-tabs [aria-selected=true]", ".stage-readout"):
        sides = page.locator(place).first.evaluate(
            "(one) => { const s = getComputedStyle(one); return [s.borderTopWidth, s.borderBottomWidth]; }"
        )
        assert max(float(side.removesuffix("px")) for side in sides) >= 1
