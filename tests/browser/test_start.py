"""A scene is chosen, dropped or written, checked while it is written, priced, and rendered."""

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
    editor,
    expect_written,
    go_to_problem,
    line_of,
    opened,
    render_button,
    selected,
    small,
    write,
)

TILES = (GALLERY / "textures" / "tiles.png").read_bytes()


def finished(page: Page) -> None:
    expect(page.locator(".job-progress .state")).to_have_text("✓ finished", timeout=TIMEOUT)


def test_gallery_scene_is_rendered(page: Page, client: httpx2.Client) -> None:
    opened(page)
    choose(page, "Texturing")
    expect_written(page, (GALLERY / "texturing.json").read_text().rstrip())
    ask_for_samples(page, 1, 4)
    opened(page)
    render_button(page).click()
    expect(page.get_by_role("heading", level=1)).to_have_text("texturing")
    finished(page)
    job = page.url.rsplit("/", 1)[1]
    asked = client.get(f"/v1/jobs/{job}/request").json()["quality"]
    assert asked["antialiasing"] == {"pattern": "sobol", "samples": 1}
    assert asked["light"] == {"pattern": "sobol", "samples": 4}


def test_mistake_is_marked_at_its_line(page: Page) -> None:
    opened(page)
    good = small("basic")
    bad = good.replace('"material": "cobalt"', '"material": "cobald"')
    write(page, bad)
    go_to_problem(page, line_of(bad, "cobald"))
    wrong = page.locator(".line.wrong")
    expect(wrong).to_have_count(1, timeout=TIMEOUT)
    expect(page.locator(".cm-lineNumbers .wrong")).to_have_text(str(line_of(bad, "cobald")))
    expect(wrong.locator(".culprit")).to_have_text('"cobald"')
    expect(editor(page)).to_contain_text("no material of this name")
    expect(render_button(page)).to_be_disabled()
    write(page, good)
    expect(wrong).to_have_count(0, timeout=TIMEOUT)
    opened(page)


@pytest.mark.slow
def test_warning_is_shown_at_its_line_and_with_the_job(page: Page) -> None:
    opened(page)
    dark = small("basic", lights=[])
    write(page, dark)
    expect(page.locator("#scene-problems")).to_contain_text("valid, with 1 warning", timeout=TIMEOUT)
    go_to_problem(page, line_of(dark, '"lights"'))
    text = page.locator(".problems li span").last.inner_text()
    opened(page)
    render_button(page).click()
    finished(page)
    expect(page.get_by_role("list", name="Warnings")).to_contain_text(text)


@pytest.mark.slow
def test_click_selects_a_mistake(page: Page) -> None:
    opened(page)
    text = small("basic").replace('"material": "cobalt"', '"material": "cobald"')
    write(page, text)
    go_to_problem(page, line_of(text, "cobald"))
    expect(editor(page)).to_be_focused()
    assert selected(page) == '"cobald"'


@pytest.mark.slow
def test_file_that_is_no_json(page: Page) -> None:
    opened(page)
    drop(page, mine__json=b'{\n  "version": 1,\n  "name" "mine"\n}')
    expect(page.get_by_role("heading", level=1, name="mine.json")).to_be_visible()
    expect(page.locator(".cm-lineNumbers .wrong")).to_have_text("3", timeout=TIMEOUT)
    expect(editor(page)).to_contain_text("This is not JSON")


@pytest.mark.slow
def test_scene_dropped_with_its_texture(page: Page) -> None:
    opened(page)
    drop(page, mine__json=small().encode(), tiles__png=TILES)
    expect(page.get_by_role("heading", level=1, name="mine.json")).to_be_visible()
    expect(page.get_by_role("listitem").filter(has_text="textures/tiles.png")).to_contain_text(
        "here", timeout=TIMEOUT
    )
    opened(page)
    render_button(page).click()
    finished(page)


@pytest.mark.slow
def test_missing_texture_can_follow(page: Page) -> None:
    opened(page)
    text = small()
    drop(page, mine__json=text.encode())
    go_to_problem(page, line_of(text, '"asset"'))
    wrong = page.locator(".cm-lineNumbers .wrong")
    expect(wrong).to_have_text(str(line_of(text, '"asset"')), timeout=TIMEOUT)
    expect(editor(page)).to_contain_text("The file textures/tiles.png is not here yet.")
    drop(page, tiles__png=TILES)
    expect(wrong).to_have_count(0, timeout=TIMEOUT)
    opened(page)


@pytest.mark.slow
def test_price_before_rendering(page: Page, client: httpx2.Client) -> None:
    opened(page)
    write(page, small("basic", name="only priced"))
    page.get_by_role("radio", name="Samples").check()
    page.get_by_label("Pattern in the pixel").select_option("random")
    quote = page.get_by_role("region", name="Quote")
    expect(quote.get_by_role("term").first).to_have_text("Time", timeout=TIMEOUT)
    # Measured, or predicted from the plan alone if the machine was busy.
    expect(quote).to_contain_text("with 2 workers")
    assert "only priced" not in [job["name"] for job in client.get("/v1/jobs").json()["jobs"]]


@pytest.mark.slow
def test_asset_name_with_escapes(page: Page) -> None:
    opened(page)
    text = small().replace('"textures/tiles.png"', '"textures\\/til\\u0065s.png"')
    assert json.loads(text) == json.loads(small())
    drop(page, mine__json=text.encode(), tiles__png=TILES)
    texture = page.locator(".files li").filter(has_text="textures/tiles.png")
    expect(texture).to_contain_text("here", timeout=TIMEOUT)
    opened(page)


@pytest.mark.slow
def test_wrong_file_can_be_replaced(page: Page) -> None:
    opened(page)
    drop(page, mine__json=small().encode(), tiles__png=TILES)
    texture = page.locator(".files li").filter(has_text="textures/tiles.png")
    expect(texture).to_contain_text("here", timeout=TIMEOUT)
    other = TILES + bytes(100_000)
    with page.expect_file_chooser() as choosing:
        texture.get_by_text("Replace").click()
    choosing.value.set_files([{"name": "any.png", "mimeType": "image/png", "buffer": other}])
    expect(texture).to_contain_text(re.compile(r"here, 1\d\d"), timeout=TIMEOUT)


@pytest.mark.slow
def test_text_behind_the_scene_is_no_field_of_the_request(page: Page) -> None:
    opened(page)
    text = small("basic")
    write(page, text + ',\n"priority": 9')
    expect(page.get_by_role("button", name=re.compile("The scene has ended"))).to_be_visible(timeout=TIMEOUT)
    expect(render_button(page)).to_be_disabled()


@pytest.mark.slow
def test_edited_scene_is_replaced_only_when_asked(page: Page) -> None:
    opened(page)
    mine = small("basic", name="hours of work")
    write(page, mine)
    choose(page, "Falloff")
    page.get_by_role("dialog").get_by_role("button", name="Keep it").click()
    expect_written(page, mine)
    choose(page, "Falloff")
    page.get_by_role("dialog").get_by_role("button", name="Replace it").click()
    expect(page.get_by_role("heading", level=1, name="Falloff")).to_be_visible()
    page.get_by_role("button", name="Undo").click()
    expect_written(page, mine)


@pytest.mark.slow
def test_service_that_is_away(page: Page) -> None:
    opened(page)
    page.context.set_offline(True)
    write(page, small("basic", name="meanwhile"))
    expect(page.locator("#scene-problems")).to_have_text("The service does not answer.", timeout=TIMEOUT)
    quote = page.get_by_role("region", name="Quote")
    expect(quote).to_have_text("A quote follows when the service answers again.")
    page.context.set_offline(False)
    opened(page)


@pytest.mark.slow
@pytest.mark.parametrize("size", [(1280, 720), (390, 844), (720, 450)], ids=["low", "phone", "at 200 %"])
def test_render_and_mistakes_are_in_sight(open_page: Open, size: tuple[int, int]) -> None:
    width, height = size
    page = open_page("/", width=width, height=height)
    opened(page)
    expect(render_button(page)).to_be_in_viewport(ratio=1)
    write(page, small("basic").replace('"width": 32', '"width": -5').replace('"version": 1', '"version": 2'))
    expect(page.get_by_text("2 problems found")).to_be_in_viewport(ratio=1, timeout=TIMEOUT)
    expect(render_button(page)).to_be_in_viewport(ratio=1)


@pytest.mark.slow
@pytest.mark.parametrize("width", [1280, 390], ids=["low", "phone"])
def test_long_and_right_to_left_names_fit(open_page: Open, width: int) -> None:
    page = open_page("/", width=width, height=720)
    opened(page)
    for name in ("x" * 230, "תמונה ארוכה מאוד " * 8):
        drop(page, **{f"{name}.json": small(name=name).encode(), f"{name}.png": TILES})
        expect(page.get_by_role("heading", level=1)).to_have_text(f"{name}.json", timeout=TIMEOUT)
        expect(page.locator(".files")).to_contain_text(name, timeout=TIMEOUT)
        assert page.evaluate("document.documentElement.scrollWidth <= innerWidth")
        expect(render_button(page)).to_be_in_viewport(ratio=1)
    assert page.get_by_role("heading", level=1).evaluate("(it) => getComputedStyle(it).direction") == "rtl"


@pytest.mark.slow
def test_preview_is_large(open_page: Open) -> None:
    page = open_page("/", width=1280, height=720)
    opened(page)
    previewed(page)
    frame = page.locator(".preview-picture").bounding_box()
    assert frame is not None
    assert frame["width"] > 1280 / 3
    assert frame["height"] > 720 / 3
    assert page.evaluate("document.documentElement.scrollHeight <= innerHeight")


def previewed(page: Page) -> str:
    """Wait for a preview, and return the address of its picture."""
    picture = page.get_by_role("img", name="Preview of the scene")
    expect(page.locator(".preview")).to_have_attribute("data-state", "current", timeout=TIMEOUT)
    return str(picture.get_attribute("src"))


@pytest.mark.slow
def test_preview_leaves_no_job(page: Page, client: httpx2.Client) -> None:
    opened(page)
    jobs = client.get("/v1/jobs").json()["jobs"]
    first = previewed(page)
    wide = page.get_by_role("img", name="Preview of the scene").evaluate("(image) => image.naturalWidth")
    assert 128 < wide <= 512
    write(page, small("falloff"))
    opened(page)
    assert previewed(page) != first
    assert client.get("/v1/jobs").json()["jobs"] == jobs


def two_textures() -> str:
    document = json.loads(small())
    document["textures"] = {
        folder: {"type": "image", "asset": f"{folder}/wood.png"} for folder in ("light", "dark")
    }
    return json.dumps(document | {"materials": materials(document)}, indent=2)


def materials(document: dict[str, Any]) -> dict[str, Any]:
    """The materials of the scene, with its textures replaced."""
    found = json.loads(re.sub(r'"texture": "[^"]*"', '"texture": "light"', json.dumps(document["materials"])))
    return dict(found)


@pytest.mark.slow
def test_file_for_one_path(page: Page) -> None:
    opened(page)
    drop(page, mine__json=two_textures().encode())
    light, dark = (
        page.get_by_role("listitem").filter(has_text=f"{name}/wood.png") for name in ("light", "dark")
    )
    expect(light).to_contain_text("Choose wood.png", timeout=TIMEOUT)
    with page.expect_file_chooser() as choosing:
        light.get_by_text("Choose wood.png").click()
    choosing.value.set_files([{"name": "any.png", "mimeType": "image/png", "buffer": TILES}])
    expect(light).to_contain_text("here", timeout=TIMEOUT)
    expect(dark).not_to_contain_text("here")


@pytest.mark.slow
def test_start_by_keyboard(open_page: Open) -> None:
    page = open_page("/")
    opened(page)
    page.keyboard.press("Tab")
    expect(page.get_by_role("link", name="Skip to the content")).to_be_focused()
    tab_to(page, "Open a scene")
    page.keyboard.press("Enter")
    tab_to(page, "Falloff")
    page.keyboard.press("Enter")
    expect(page.get_by_role("heading", level=1, name="Falloff")).to_be_visible()
    tab_to(page, "Scene, as JSON")
    page.keyboard.press("Control+A")
    page.keyboard.insert_text(small("falloff", name="by keyboard"))
    tab_to(page, "As written")
    page.keyboard.press("ArrowRight")
    expect(page.get_by_role("radio", name="Samples")).to_be_checked()
    opened(page)
    page.keyboard.press("Control+Enter")
    page.wait_for_url("**/jobs/*", timeout=TIMEOUT)
    expect(page.get_by_role("heading", level=1)).to_have_text("by keyboard", timeout=TIMEOUT)


FOCUSED = """() => {
  const focused = document.activeElement;
  return focused.getAttribute("aria-label") ?? focused.closest("label")?.textContent ?? focused.textContent;
}"""
MOST_STOPS = 60


def tab_to(page: Page, name: str) -> None:
    """Press Tab until what has this name has the focus."""
    for _ in range(MOST_STOPS):
        if page.evaluate(FOCUSED).strip() == name:
            return
        page.keyboard.press("Tab")
    raise AssertionError(f"no way leads to {name}")
