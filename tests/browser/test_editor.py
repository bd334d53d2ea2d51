"""The editor of a scene: what it says about fields and problems, and its keys."""

from __future__ import annotations

import json
import re

import pytest
from playwright.sync_api import Locator, Page, expect

from tests.browser.conftest import Open
from tests.browser.scenes import (
    GALLERY,
    TIMEOUT,
    drop,
    editor,
    expect_written,
    go_to_problem,
    opened,
    selected,
    small,
    write,
)

FIELD = """async (steps) => {
  const { fieldAt } = await import("/web/scene_fields.js");
  const schema = await (await fetch("/v1/schemas/scene.json")).json();
  return fieldAt(schema, steps);
}"""


def line(page: Page, text: str) -> Locator:
    return page.locator(".cm-line").filter(has_text=text).first


def test_a_message_stands_in_what_is_seen_of_the_editor(open_page: Open) -> None:
    page = open_page("/", width=390, height=844)
    opened(page)
    # One line that is far longer than the screen is wide, wrong at its end.
    text = json.dumps(json.loads(small("basic")) | {"lights": [{"type": "point", "color": [1, 1, 1]}]})
    write(page, text)
    go_to_problem(page, 1)
    message = page.locator(".editor .detail").first
    expect(message).to_be_visible()
    inner, outer = message.bounding_box(), page.locator(".editor").bounding_box()
    assert inner is not None
    assert outer is not None
    assert outer["x"] <= inner["x"]
    assert inner["x"] + inner["width"] <= outer["x"] + outer["width"]
    assert outer["y"] <= inner["y"] <= outer["y"] + outer["height"]


def test_tab_leaves_the_editor(page: Page) -> None:
    opened(page)
    text = small("basic")
    write(page, text)
    editor(page).press("Tab")
    expect(editor(page)).not_to_be_focused()
    expect_written(page, text)


def test_the_field_under_the_pointer_is_explained(page: Page) -> None:
    opened(page)
    write(page, small("basic"))
    line(page, "vertical_fov").locator(".key").hover()
    hint = page.locator(".field-hint")
    expect(hint).to_contain_text("Angle of view from bottom to top", timeout=TIMEOUT)
    expect(hint).to_contain_text("by default 40")


def test_a_field_that_is_at_the_cursor_and_under_the_pointer_is_explained_once(page: Page) -> None:
    opened(page)
    write(page, small("basic"))
    line(page, "vertical_fov").locator(".key").click()
    hint = page.locator(".field-hint")
    expect(hint).to_have_count(1, timeout=TIMEOUT)
    editor(page).press("Control+i")
    expect(page.locator("#announcer")).to_contain_text("Angle of view from bottom to top")
    expect(hint).to_have_count(1)


def test_the_field_at_the_cursor_is_explained_on_demand(page: Page) -> None:
    opened(page)
    write(page, small("basic"))
    line(page, "vertical_fov").locator(".key").click()
    editor(page).press("Control+i")
    hint = page.locator(".field-hint")
    expect(hint).to_contain_text("Angle of view from bottom to top", timeout=TIMEOUT)
    expect(page.locator("#announcer")).to_contain_text("Angle of view from bottom to top")
    editor(page).press("Escape")
    expect(hint).to_have_count(0)


def step(name: str | None, of: str | None = None, inner: str | None = None) -> dict[str, str | None]:
    return {"name": name, "type": of, "inner": inner}


SHAPES = (step("shapes"), step(None, inner="ellipsoid"))


@pytest.mark.parametrize(
    ("steps", "said"),
    [
        pytest.param([step("camera"), step("look_at")], "in the middle of the picture", id="referenced"),
        pytest.param([*SHAPES, step("radius", "ellipsoid")], "radius", id="of-a-type"),
        pytest.param([step("materials"), step("red", inner="phong")], "Phong", id="named-by-the-user"),
        pytest.param([step("lights"), step(None), step("type", "point")], "light", id="the-type-itself"),
    ],
)
def test_a_field_is_found_through_the_types_around_it(
    bare_page: Page, steps: list[dict[str, str | None]], said: str
) -> None:
    found = bare_page.evaluate(FIELD, steps)
    assert said.lower() in " ".join(found["paragraphs"]).lower()


@pytest.mark.parametrize("steps", [[step("cameras")], [*SHAPES, step("corner", "ellipsoid")]])
def test_a_field_that_the_language_lacks_has_no_hint(
    bare_page: Page, steps: list[dict[str, str | None]]
) -> None:
    assert bare_page.evaluate(FIELD, steps) is None


def test_f8_goes_from_problem_to_problem(page: Page) -> None:
    opened(page)
    write(page, small("basic").replace('"version": 1', '"version": 2').replace('"width": 32', '"width": -5'))
    expect(page.locator(".line.wrong")).to_have_count(2, timeout=TIMEOUT)
    for expected in ("2", "-5", "2"):
        editor(page).press("F8")
        assert selected(page) == expected


def test_a_section_is_folded_and_the_text_keeps_it(page: Page) -> None:
    opened(page)
    text = small("basic")
    write(page, text)
    line(page, '"camera"').click()
    editor(page).press("Control+Shift+BracketLeft")
    expect(line(page, "vertical_fov")).to_have_count(0)
    expect_written(page, text)
    editor(page).press("Control+Shift+BracketRight")
    expect(line(page, "vertical_fov")).to_be_visible()


def test_a_bracket_whose_partner_is_far_out_of_sight_is_not_marked_as_wrong(page: Page) -> None:
    # The cursor is before the bracket in which the whole scene stands.
    opened(page)
    bracket = page.locator(".cm-line").first.locator("span", has_text="{")
    expect(bracket.first).to_have_class(re.compile("(non)?matchingBracket"))
    for part in bracket.all():
        expect(part).to_have_css("background-color", "rgba(0, 0, 0, 0)")


def test_a_text_is_found_that_is_far_out_of_sight(page: Page) -> None:
    opened(page)
    write(page, small("basic"))
    editor(page).press("Control+f")
    page.get_by_role("textbox", name="Find", exact=True).press_sequentially('"lights"')
    page.keyboard.press("Enter")
    expect(line(page, '"lights"')).to_be_in_viewport()
    page.keyboard.press("Escape")
    assert selected(page) == '"lights"'


def test_typing_is_undone_but_not_the_opening_of_a_scene(page: Page) -> None:
    opened(page)
    page.get_by_role("button", name="Falloff", exact=True).click()
    text = (GALLERY / "falloff.json").read_text().rstrip()
    expect_written(page, text)
    editor(page).press("Control+End")
    page.keyboard.type(" ")
    expect_written(page, f"{text} ")
    editor(page).press("Control+z")
    expect_written(page, text)
    editor(page).press("Control+z")
    expect_written(page, text)


def test_typing_replaces_what_is_selected_over_several_lines(page: Page) -> None:
    opened(page)
    write(page, small("basic"))
    editor(page).press("Control+A")
    page.keyboard.type("7")
    expect_written(page, "7")


def test_a_file_that_is_dropped_on_the_editor_is_opened(page: Page) -> None:
    opened(page)
    drop(page, onto=".cm-content", mine__json=small("basic").encode())
    expect(page.get_by_role("heading", level=2, name="mine.json")).to_be_visible()
    expect_written(page, small("basic"))


def test_what_is_read_only_takes_no_text(bare_page: Page) -> None:
    bare_page.evaluate(
        """async () => {
          const { makeEditor } = await import("/web/editor.js");
          const editor = makeEditor({ label: "Only to be read", readOnly: true });
          document.getElementById("main").append(editor.element);
          editor.text = "{}";
        }"""
    )
    shown = bare_page.get_by_role("textbox", name="Only to be read")
    shown.press("x")
    expect(shown).to_have_text("{}")
    expect(shown).to_have_attribute("aria-readonly", "true")
