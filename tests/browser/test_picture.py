"""The picture of a job in the browser: it fills in, equals that of the service, and shows its numbers."""

import base64
import io
import json
import os
import re
import signal
from pathlib import Path
from typing import Any

import httpx2
import numpy as np
import pytest
from matplotlib import colormaps
from playwright.sync_api import Browser, Page, expect

from renderer.images import files as image_files
from renderer.tiling import TILE_SIDE
from schemas.scene import Display
from service.settings import Settings
from tests.browser.conftest import Open, Shoot
from tests.browser.pictures import (
    COVERED,
    Rectangle,
    at_work,
    click_at,
    codes_of,
    finished,
    opened,
    outlined,
    point_at,
    served,
)
from tests.browser.scenes import ENDLESS_SIDE, TIMEOUT, endless, small
from tests.service.forking import running
from tests.service.support import finish, image, long_scene, scene, submit, until

ENCODE = """async ([text, exposure, transfer]) => {
    const { Encoder } = await import("/web/views/picture/transfer.js");
    const bytes = Uint8Array.from(atob(text), (letter) => letter.charCodeAt(0));
    const bits = new Uint32Array(bytes.buffer);
    const rgba = new Uint8ClampedArray((bits.length / 3) * 4);
    new Encoder(exposure, transfer).write(bits, 0, new Uint32Array(rgba.buffer), 0, bits.length / 3);
    let codes = "";
    rgba.forEach((code, i) => i % 4 < 3 && (codes += String.fromCharCode(code)));
    return btoa(codes);
}"""
LAYERS = ["depth", "normal", "shape", "samples"]
VIRIDIS_FIT = 2
"""Codes by which the false colours are off at most between their samples, rounding included."""


GRID = {
    (x, y, x + TILE_SIDE, y + TILE_SIDE)
    for x in range(0, ENDLESS_SIDE, TILE_SIDE)
    for y in range(0, ENDLESS_SIDE, TILE_SIDE)
}
"""The tiles of an endless job."""


def awkward_numbers() -> np.ndarray:
    """Floats of every size and sign, neighbours of all codes' limits, and those that are no numbers."""
    random = np.random.default_rng(5)
    drawn = random.integers(0, 2**32, 60_000, dtype=np.uint32).view(np.float32)
    limits = ((np.arange(1, 256) - 0.5) / 255).astype(np.float64)
    linear = np.where(limits <= 0.04045, limits / 12.92, ((limits + 0.055) / 1.055) ** 2.4)
    edges = np.concatenate([limits, linear]).astype(np.float32)
    near = [np.nextafter(edges, np.float32(side)) for side in (0, 1)]
    odd = np.array([0, -0.0, 1, np.nan, np.inf, -np.inf, 1e-45, -1e-45, 3.4e38], np.float32)
    even = np.linspace(0, 1, 60_000, dtype=np.float32)
    values = np.concatenate([drawn[~np.isnan(drawn)], even, edges, *near, odd])
    return values[: values.size // 3 * 3]


@pytest.mark.parametrize(
    ("transfer", "exposure"),
    [("srgb", 0.0), ("linear", 0.0), ("srgb", 0.7), ("srgb", -9.5), ("linear", 20.0)],
)
def test_codes_equal_the_service(bare_page: Page, transfer: Any, exposure: float) -> None:
    values = awkward_numbers()
    got = bare_page.evaluate(ENCODE, [base64.b64encode(values.tobytes()).decode(), exposure, transfer])
    display = Display(transfer=transfer, exposure=exposure)
    codes = np.frombuffer(base64.b64decode(got), np.uint8)
    served = image_files.displayed(values.reshape(1, -1, 3), display)
    np.testing.assert_array_equal(codes, served.ravel())


@pytest.mark.parametrize("display", [{}, {"transfer": "linear", "exposure": 0.6}])
def test_canvas_equals_the_png(open_page: Open, client: httpx2.Client, display: dict[str, Any]) -> None:
    # 100 x 70 pixels are several tiles, none of which has the size of another.
    job = submit(client, scene(100, 70) | {"display": display})
    page = open_page(f"/jobs/{job}")
    expect(page.locator(".state")).to_contain_text("finished", timeout=20_000)
    page.wait_for_function(COVERED)
    np.testing.assert_array_equal(codes_of(page), served(client, job))


@pytest.mark.slow
def test_running_picture_is_coarse_at_once(open_page: Open, client: httpx2.Client) -> None:
    job = submit(client, long_scene())
    page = open_page(f"/jobs/{job}")
    page.wait_for_function(COVERED)
    expect(page.locator(".state")).not_to_contain_text("finished")
    page.reload()
    page.wait_for_function(COVERED)
    finish(client, job)
    expect(page.locator(".state")).to_contain_text("finished", timeout=20_000)
    expect(page.locator(".bar-line")).to_have_class(re.compile("done"))
    np.testing.assert_array_equal(codes_of(page), served(client, job))


@pytest.mark.slow
def test_tiles_at_work_are_outlined(open_page: Open, client: httpx2.Client) -> None:
    job = endless(client, "outlined")
    page = open_page(f"/jobs/{job}")
    page.wait_for_function(COVERED)
    wanted: set[Rectangle] = set()

    def all_shown() -> bool:
        # A tile may finish between two checks, and the first event is the whole picture.
        nonlocal wanted
        wanted = at_work(client, job)
        return bool(wanted) and outlined(page, GRID) == wanted

    until(all_shown)
    client.post(f"/v1/jobs/{job}/cancel")
    expect(page.locator(".state")).to_contain_text("cancelled", timeout=TIMEOUT)
    until(lambda: not outlined(page, GRID))


@pytest.mark.slow
def test_focus_around_a_pixel(open_page: Open, client: httpx2.Client) -> None:
    job = submit(client, long_scene())
    page = open_page(f"/jobs/{job}")
    page.wait_for_function(COVERED)
    button = page.get_by_role("button", name="This part first")
    expect(button).to_be_disabled()
    click_at(page, 200, 150, (256, 256))
    with page.expect_response(lambda response: response.url.endswith("/focus")) as answered:
        button.click()
    assert answered.value.status == 204
    # A quarter of both sides.
    assert answered.value.request.post_data_json == {"x0": 168, "y0": 118, "x1": 232, "y1": 182}
    client.post(f"/v1/jobs/{job}/cancel")
    expect(button).to_be_hidden()


@pytest.mark.slow
def test_missing_picture_has_a_reason(open_page: Open, client: httpx2.Client) -> None:
    job = submit(client, long_scene() | {"name": "in vain"})
    client.post(f"/v1/jobs/{job}/cancel")
    page = open_page(f"/jobs/{job}")
    # Workers first stop the tiles that they may have begun.
    expect(page.get_by_text("There is no picture: the job ended as cancelled.")).to_be_visible(
        timeout=TIMEOUT
    )
    expect(page.locator(".screen")).to_be_hidden()


def test_read_out_equals_the_npy(open_page: Open, client: httpx2.Client) -> None:
    job = finished(client)
    page = opened(open_page, job)
    pixels = image(client, job)
    for x, y in ((30, 30), (45, 12), (0, 47)):
        point_at(page, x, y)
        readout = page.locator(".readout")
        expect(readout).to_have_text(re.compile(rf"^{x}, {y} "))
        linear, shown = readout.inner_text().split("linear")[1].split("shown")
        # The read-out shows four digits.
        assert [float(word) for word in linear.split()] == [float(f"{value:.4g}") for value in pixels[y, x]]
        assert [int(word) for word in shown.split()] == served(client, job)[y, x].tolist()


@pytest.mark.slow
def test_wheel_zooms_and_drag_pans(open_page: Open, client: httpx2.Client) -> None:
    page = opened(open_page, finished(client))
    point_at(page, 20, 30)
    for _ in range(8):
        page.mouse.wheel(0, -240)
    box = page.locator("canvas.pixels").bounding_box()
    assert box is not None
    assert box["width"] > 2000
    readout = page.locator(".readout")
    page.mouse.move(*page.evaluate("[0, 0]"))
    point = page.locator(".screen").bounding_box()
    assert point is not None
    middle = (point["x"] + 200, point["y"] + 200)
    page.mouse.move(*middle)
    before = readout.inner_text()
    page.mouse.down()
    page.mouse.move(middle[0] + 130, middle[1] + 40, steps=4)
    page.mouse.up()
    expect(page.get_by_role("heading", name="Pixel")).to_have_count(0)  # dragging is no click
    assert readout.inner_text() == before  # what was under the mouse has come along
    page.mouse.move(*middle)
    expect(readout).not_to_have_text(before)


@pytest.mark.slow
def test_two_fingers_zoom(open_page: Open, client: httpx2.Client) -> None:
    page = opened(open_page, finished(client), has_touch=True)
    page.locator(".screen").scroll_into_view_if_needed()
    before = page.locator("canvas.pixels").bounding_box()
    assert before is not None
    x, y = before["x"] + before["width"] / 3, before["y"] + before["height"] / 2
    session = page.context.new_cdp_session(page)
    # The fingers move apart, from 100 to 200 dots.
    for kind, apart in [("touchStart", 100), *(("touchMove", 100 + 10 * i) for i in range(11))]:
        points = [{"x": x - apart / 2, "y": y, "id": 0}, {"x": x + apart / 2, "y": y, "id": 1}]
        session.send("Input.dispatchTouchEvent", {"type": kind, "touchPoints": points})
    session.send("Input.dispatchTouchEvent", {"type": "touchEnd", "touchPoints": []})
    after = page.locator("canvas.pixels").bounding_box()
    assert after is not None
    assert after["width"] == pytest.approx(2 * before["width"], rel=1e-3)
    # The point between them stays there, to a dot.
    assert after["x"] + after["width"] / 3 == pytest.approx(x, abs=1)
    assert after["y"] + after["height"] / 2 == pytest.approx(y, abs=1)
    expect(page.get_by_role("heading", name="Pixel")).to_have_count(0)  # no pixel was chosen


@pytest.mark.slow
def test_layer_in_false_colours(open_page: Open, client: httpx2.Client, shoot: Shoot) -> None:
    job = finished(client, layers=LAYERS)
    page = opened(open_page, job)
    depth = layer(client, job, "depth")
    point_at(page, 40, 20)
    page.get_by_label("Shown").select_option("depth")
    expect(page.locator(".readout")).to_contain_text(f"depth {depth[20, 40]:.4g}")
    expect(page.locator(".legend")).to_contain_text("scene units")
    near, far = depth.min(), depth[np.isfinite(depth)].max()
    ends = [page.get_by_label(f"{end} value").input_value() for end in ("Lowest", "Highest")]
    assert [float(end) for end in ends] == [float(f"{value:.4g}") for value in (near, far)]
    codes = codes_of(page).astype(int)
    assert (codes[~np.isfinite(depth)] == 128).all()
    hit = np.isfinite(depth)
    expected = colormaps["viridis"]((depth[hit] - near) / (far - near))[:, :3] * 255
    # The place in the table is rounded, too: half a step of it is at most two codes.
    assert np.abs(codes[hit] - expected).max() <= VIRIDIS_FIT + 2
    page.get_by_label("Shown").select_option("normal")
    expect(page.locator(".legend")).to_contain_text("Red, green and blue are x, y and z")
    # The floor faces up: (0, 1, 0) is shown as the middle, the greatest and the middle.
    assert codes_of(page)[47, 0].tolist() == [128, 255, 128]
    shoot(page, "picture-normals")


def layer(client: httpx2.Client, job: str, name: str) -> np.ndarray:
    return np.asarray(np.load(io.BytesIO(client.get(f"/v1/jobs/{job}/layers/{name}.npy").content)))


@pytest.mark.slow
def test_pixel_by_keyboard(open_page: Open, client: httpx2.Client) -> None:
    job = finished(client)
    page = opened(open_page, job)
    for _ in range(40):
        page.keyboard.press("Tab")
        if page.evaluate("document.activeElement.className").startswith("screen"):
            break
    page.keyboard.press("ArrowLeft")
    page.keyboard.press("Shift+ArrowLeft")
    page.keyboard.press("ArrowDown")
    expect(page.locator(".readout")).to_have_text(re.compile("^29, 25 "))
    page.keyboard.press("+")
    page.keyboard.press("+")
    expect(page.locator(".readout")).to_have_text(re.compile("^29, 25 "))
    page.keyboard.press("Enter")
    expect(page.get_by_role("heading", name="Pixel 29, 25")).to_be_visible()
    expect(page.locator("#announcer")).to_contain_text("This point is unlit")


@pytest.mark.slow
def test_page_survives_a_killed_service(chromium: Browser, tmp_path: Path) -> None:
    # A single worker finishes tiles in the order in which it gets them.
    settings = Settings(data=tmp_path, port=0, workers=1, tile_size=32, log_level="error", max_wait_seconds=5)
    with running(settings) as first:
        port = int(first.url.rpartition(":")[2])
        with httpx2.Client(base_url=first.url, timeout=60) as client:
            job = submit(client, long_scene())
        page = chromium.new_page()
        page.goto(f"{first.url}/jobs/{job}")
        page.wait_for_function(COVERED)
        click_at(page, 200, 150, (256, 256))
        with page.expect_request("**/focus") as asked:
            page.get_by_role("button", name="This part first").click()
        wanted = asked.value.post_data_json
        assert asked.value.response().ok
        os.kill(first.process.pid, signal.SIGKILL)
        first.process.wait()
        expect(page.get_by_text("does not answer. Trying again")).to_be_visible()
    with (
        running(settings.model_copy(update={"port": port})) as again,
        httpx2.Client(base_url=again.url, timeout=60) as client,
    ):
        finish(client, job)
        expect(page.locator(".state")).to_contain_text("finished", timeout=20_000)
        expect(page.get_by_text("does not answer. Trying again")).to_be_hidden()
        expect(page.locator(".bar-line")).to_have_class(re.compile("done"))
        np.testing.assert_array_equal(codes_of(page), served(client, job))
        events = client.get(f"/v1/jobs/{job}/tiles").json()["events"]
        last = [event for event in events if event["pass_index"] == events[-1]["pass_index"]]
        # The requested part comes first after the restart, too.
        within = [overlap(event, wanted) for event in last]
        assert within == sorted(within, reverse=True)
        assert 0 < sum(within) < len(within) == 64
    page.close()


def overlap(one: dict[str, int], other: dict[str, int]) -> bool:
    """Whether two rectangles have pixels in common."""
    return all(one[f"{axis}0"] < other[f"{axis}1"] and other[f"{axis}0"] < one[f"{axis}1"] for axis in "xy")


@pytest.mark.slow
def test_large_picture_comes_as_png_and_then_in_half_floats(open_page: Open, client: httpx2.Client) -> None:
    large = json.loads(small("basic"))
    large["camera"] |= {"width": 1200, "height": 900}
    job = submit(client, large)
    final = finish(client, job)["links"]["image_png"]
    page = open_page(f"/jobs/{job}")
    page.wait_for_function(COVERED)
    assert final in page.locator("canvas.pixels").evaluate("canvas => canvas.style.backgroundImage")
    expect(page.locator(".bar-line")).to_have_class(re.compile("done"))
    [first, second] = page.evaluate(FETCHED, job)
    assert (first["name"], second["name"]) == ("image.png", "tiles")
    assert second["begin"] > first["end"]
    assert 6 * 1200 * 900 < second["bytes"] < 1.01 * 6 * 1200 * 900
    # The tiles of a final picture are kept under its hash.
    page.reload()
    page.wait_for_function(COVERED)
    assert all(sent["bytes"] < 1000 for sent in page.evaluate(FETCHED, job))


FETCHED = """job => performance.getEntriesByType("resource").flatMap((entry) => {
  const name = /\\/(image.png|tiles)/.exec(entry.name)?.[1];
  if (!name || !entry.name.includes(job)) return [];
  return [{ name, begin: entry.requestStart, end: entry.responseEnd, bytes: entry.transferSize }];
})"""
