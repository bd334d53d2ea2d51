"""The editor of a scene: what it says about fields and problems, and its keys."""

import json
import re

import pytest
from playwright.sync_api import Locator, Page, expect

from tests.browser.conftest import Open, Shoot
from tests.browser.scenes import (
    GALLERY,
    TIMEOUT,
    choose,
    drop,
    editor,
    expect_written,
    go_to_problem,
    opened,
    selected,
    small,
    write,
)


def scrolled(page: Page) -> float:
    """How far the editor's lines are scrolled sideways."""
    left = page.locator(".cm-scroller").evaluate("element => element.scrollLeft")
    assert isinstance(left, int | float)
    return left


def line(page: Page, text: str) -> Locator:
    return page.locator(".cm-line").filter(has_text=text).first


@pytest.mark.slow
def test_message_is_in_sight(open_page: Open) -> None:
    page = open_page("/", width=390, height=844)
    opened(page)
    # One line that is far longer than the screen is wide, wrong at its end.
    scene = json.loads(small("basic"))
    write(page, json.dumps(scene | {"lights": [{"type": "point", "color": [1, 1, 1]}]}))
    go_to_problem(page, 1)
    message = page.locator(".editor .detail").first
    expect(message).to_be_visible()
    inner, outer = message.bounding_box(), page.locator(".editor").bounding_box()
    assert inner is not None
    assert outer is not None
    assert outer["x"] <= inner["x"]
    assert inner["x"] + inner["width"] <= outer["x"] + outer["width"]
    assert outer["y"] <= inner["y"] <= outer["y"] + outer["height"]
    culprit = page.locator(".culprit").first.bounding_box()
    assert culprit is not None
    assert outer["x"] <= culprit["x"]
    assert culprit["x"] + culprit["width"] <= outer["x"] + outer["width"]
    # What is in sight does not move.
    write(page, json.dumps(scene | {"version": 2}))
    expect(page.locator(".culprit")).to_have_text("2", timeout=TIMEOUT)
    go_to_problem(page, 1)
    assert selected(page) == "2"
    assert scrolled(page) == 0


@pytest.mark.slow
def test_tab_leaves_the_editor(page: Page) -> None:
    opened(page)
    text = small("basic")
    write(page, text)
    editor(page).press("Tab")
    expect(editor(page)).not_to_be_focused()
    expect_written(page, text)


@pytest.mark.slow
def test_field_under_the_pointer(page: Page) -> None:
    opened(page)
    write(page, small("basic"))
    line(page, "vertical_fov").locator(".key").hover()
    hint = page.locator(".field-hint")
    expect(hint).to_contain_text("Angle of view from bottom to top", timeout=TIMEOUT)
    expect(hint).to_contain_text("by default 40")


@pytest.mark.slow
def test_field_at_the_cursor(page: Page) -> None:
    opened(page)
    write(page, small("basic"))
    line(page, "vertical_fov").locator(".key").click()
    editor(page).press("Control+i")
    hint = page.locator(".field-hint")
    expect(hint).to_contain_text("Angle of view from bottom to top", timeout=TIMEOUT)
    expect(page.locator("#announcer")).to_contain_text("Angle of view from bottom to top")
    editor(page).press("Escape")
    expect(hint).to_have_count(0)


@pytest.mark.slow
def test_f8_goes_to_the_next_problem(page: Page) -> None:
    opened(page)
    write(page, small("basic").replace('"version": 1', '"version": 2').replace('"width": 32', '"width": -5'))
    expect(page.locator(".line.wrong")).to_have_count(2, timeout=TIMEOUT)
    for expected in ("2", "-5", "2"):
        editor(page).press("F8")
        assert selected(page) == expected


@pytest.mark.slow
def test_problem_moves_with_its_line(page: Page) -> None:
    """Until the service has checked the new text, which it never does here."""
    opened(page)
    write(page, small("basic").replace('"width": 32', '"width": -5'))
    expect(page.locator(".line.wrong")).to_have_count(1, timeout=TIMEOUT)
    page.route("**/v1/plans", lambda _: None)
    line(page, '"width": -5').click()
    editor(page).press("Home")
    editor(page).press("Home")
    editor(page).press("Enter")
    expect(page.locator(".line.wrong")).to_contain_text('"width": -5')
    # The line above goes with its end, which is all there is before the mark.
    editor(page).press("Shift+ArrowUp")
    editor(page).press("Delete")
    expect(page.locator(".line.wrong")).to_contain_text('"width": -5')
    expect(page.locator(".line.wrong + .details")).to_be_visible()


@pytest.mark.slow
def test_field_that_was_meant_is_named(page: Page) -> None:
    opened(page)
    write(page, small("basic").replace('"width": 32', '"widht": 32'))
    for place in (page.locator(".editor .detail"), page.locator(".problems")):
        expect(place).to_contain_text('Did you mean "width"?', timeout=TIMEOUT)


@pytest.mark.slow
def test_search_far_out_of_sight(page: Page) -> None:
    opened(page)
    write(page, small("basic"))
    editor(page).press("Control+f")
    page.get_by_role("textbox", name="Find", exact=True).press_sequentially('"lights"')
    page.keyboard.press("Enter")
    expect(line(page, '"lights"')).to_be_in_viewport()
    page.keyboard.press("Escape")
    assert selected(page) == '"lights"'


@pytest.mark.slow
def test_undo_stops_at_the_opened_scene(page: Page) -> None:
    opened(page)
    choose(page, "Falloff")
    text = (GALLERY / "falloff.json").read_text().rstrip()
    expect_written(page, text)
    editor(page).press("Control+End")
    page.keyboard.type(" ")
    expect_written(page, f"{text} ")
    editor(page).press("Control+z")
    expect_written(page, text)
    editor(page).press("Control+z")
    expect_written(page, text)


@pytest.mark.slow
def test_dropped_file_is_opened(page: Page) -> None:
    opened(page)
    drop(page, onto=".cm-content", mine__json=small("basic").encode())
    expect(page.get_by_role("heading", level=1, name="mine.json")).to_be_visible()
    expect_written(page, small("basic"))


CURSOR = """async (at) => {
  const { EditorView } = await import("/web/vendor/codemirror/codemirror.js");
  const view = EditorView.findFromDOM(document.querySelector(".editor"));
  view.dispatch({ selection: { anchor: at } });
}"""


def write_to_cursor(page: Page, text: str) -> None:
    """Write a text, and go to where it has a bar."""
    write(page, text.replace("|", ""))
    page.evaluate(CURSOR, text.index("|"))


def options(page: Page) -> Locator:
    return page.get_by_role("listbox").get_by_role("option")


@pytest.mark.slow
def test_field_is_completed(page: Page, shoot: Shoot) -> None:
    opened(page)
    write_to_cursor(page, '{"version": 1, "camera": {"position": [0, 0, 4], |}}')
    page.keyboard.type('"')
    # Required fields come first, and none that is there already.
    expect(options(page).first).to_contain_text("look_at", timeout=TIMEOUT)
    expect(options(page).filter(has_text="position")).to_have_count(0)
    page.keyboard.type("vert")
    expect(options(page)).to_have_text("vertical_fov")
    expect(page.locator(".cm-completionInfo")).to_contain_text("Angle of view from bottom to top")
    shoot(page, "completion")
    page.keyboard.press("Tab")
    expect(editor(page)).to_be_focused()
    page.keyboard.type("40, ")
    # On request a list opens without a quote, and letters filter it all the same.
    page.keyboard.press("Control+Space")
    expect(options(page).filter(has_text="look_at")).to_be_visible()
    for letter in "wi":
        page.keyboard.type(letter)
        expect(options(page).first).to_have_text("width")
    page.keyboard.press("Tab")
    page.keyboard.type("9")
    written = '{"version": 1, "camera": {"position": [0, 0, 4], "vertical_fov": 40, "width": 9}}'
    expect_written(page, written)
    # Of two sets of fields either is offered, until a field of one is written.
    for present, centers, corners in (
        ("", "or corner, edges", ["corneror center, normal, tangent, size"]),
        ('"size": [1, 1], ', "required", []),
    ):
        write_to_cursor(page, f'{{"shapes": [{{"type": "rectangle", {present}|}}]}}')
        page.keyboard.press("Control+Space")
        center, corner = (
            options(page).filter(has_text=re.compile(f"^{name}")) for name in ("center", "corner")
        )
        expect(center).to_have_text(f"center{centers}")
        expect(corner).to_have_text(corners)


@pytest.mark.slow
def test_value_is_completed(page: Page) -> None:
    """Values of the language, and names that the scene defines; the list opens on request as well."""
    opened(page)
    defined = '{"materials": {"red wall": {"type": "phong"}}, "textures": {"bricks": {"type": "checker"}}, '
    for text, expected in (
        ('"lights": [{"type": "s|", "cone": 3}]}', ["spot"]),
        ('"lights": [{"type": |, "cone": 3}]}', ["rectangle", "point", "spot", "directional"]),
        ('"sampling": {"antialiasing": {"pattern": "sobol"}, "light": {"pattern": "st|"}}}', ["stratified"]),
        ('"shapes": [{"type": "triangle", "material": "r|"}]}', ["red wall"]),
        ('"more": {"type": "phong", "bump_map": "|\n}}', ["bricks"]),
    ):
        write_to_cursor(page, defined + text)
        page.keyboard.press("Control+Space")
        expect(options(page)).to_have_text(expected, timeout=TIMEOUT)
        page.keyboard.press("ArrowUp")
        page.keyboard.press("Enter")
        expect(options(page)).to_have_count(0)
        expect_written(page, defined + re.sub(r'("\w*)?\|"?', json.dumps(expected[-1]), text))


@pytest.mark.slow
def test_completion_stays_out_of_the_way(page: Page) -> None:
    """No list opens outside of strings; without one Enter begins a line and Tab leaves the editor."""
    opened(page)
    write_to_cursor(page, '{"name": "a", "camera": {|}}')
    page.keyboard.type('"look_at": [0, 1')
    expect(options(page)).to_have_count(0)
    page.keyboard.type('], "')
    expect(options(page).first).to_be_visible(timeout=TIMEOUT)
    page.keyboard.press("Escape")
    expect(options(page)).to_have_count(0)
    page.keyboard.press("Enter")
    page.keyboard.press("Tab")
    expect(editor(page)).not_to_be_focused()
    expect_written(page, '{"name": "a", "camera": {"look_at": [0, 1], "\n}}')
