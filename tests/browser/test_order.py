"""The quality and the labels of a job: mistakes stand at their fields, and quotes end with their scene."""

from __future__ import annotations

import pytest
from playwright.sync_api import Page, expect

from tests.browser.conftest import Open
from tests.browser.scenes import TIMEOUT, ask_for_samples, opened, render_button, small, write


def test_number_out_of_range_is_refused_at_its_field(page: Page) -> None:
    opened(page)
    page.get_by_role("radio", name="Target error").check()
    error = page.get_by_label("Error (code values of 255)")
    for wrong in ("0", "-1", "300"):
        error.fill(wrong)
        expect(error).to_have_accessible_description("Write a number from 0.01 to 255.")
        expect(page.locator(".problems")).to_contain_text(
            "Error (code values of 255): Write", timeout=TIMEOUT
        )
        expect(error).to_have_value(wrong)
        expect(render_button(page)).to_be_disabled()
    page.locator(".problems button").click()
    expect(error).to_be_focused()
    error.fill("2")
    expect(error).to_have_accessible_description("")
    opened(page)


@pytest.mark.slow
def test_number_that_is_no_square_stands_at_its_field_after_a_reload(page: Page) -> None:
    """The page says so while it is written, the service where it was kept."""
    opened(page)
    ask_for_samples(page, 5, 4)
    page.get_by_label("Pattern in the pixel").select_option("uniform")
    samples = page.get_by_label("Samples per pixel")
    expect(samples).to_have_accessible_description("This pattern is a square grid: write 4 or 9.")
    page.reload()
    expect(samples).to_have_attribute("aria-invalid", "true", timeout=TIMEOUT)
    expect(samples).to_have_value("5")
    expect(render_button(page)).to_be_disabled()


@pytest.mark.slow
def test_choice_of_quality_stays_under_the_pointer(open_page: Open) -> None:
    page = open_page("/", width=1440, height=900)
    opened(page)
    place = page.locator(".segments").bounding_box()
    for name in ("Samples", "Target error", "Time", "As written"):
        page.get_by_role("radio", name=name).check()
        assert page.locator(".segments").bounding_box() == place, name


@pytest.mark.slow
def test_mistake_in_a_label_names_it(page: Page) -> None:
    opened(page)
    write(page, small("basic"))
    labels = page.get_by_label("Labels")
    twice = "week:3, course:graphics, week:4"
    for written, named in (("two words:1", "two words"), (f"week:{'3' * 300}", "week"), (twice, "week")):
        labels.fill(written)
        opened(page)
        render_button(page).click()
        expect(page.get_by_role("alert").filter(has_text=f'Label "{named}": ')).to_be_visible(timeout=TIMEOUT)
        expect(labels).to_be_focused()
    labels.fill("week:3")
    expect(page.get_by_role("alert")).to_have_count(0)


@pytest.mark.slow
def test_pending_quote_ends_with_its_scene(page: Page) -> None:
    quote = page.get_by_role("region", name="Quote")
    expect(quote).to_have_text("A quote follows when you stop typing.", timeout=TIMEOUT)
    write(page, small("basic").replace('"version": 1', '"version": 2'))
    expect(quote).to_have_text("A quote follows when the errors are corrected.", timeout=TIMEOUT)
    page.wait_for_timeout(1500)
    expect(quote).to_have_text("A quote follows when the errors are corrected.", timeout=1)
