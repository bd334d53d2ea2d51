"""The inspector in the browser: why a pixel is dark, what each light adds, which lines of the scene."""

import re

import httpx2
import pytest
from playwright.sync_api import expect

from tests.browser.conftest import Open, Shoot
from tests.browser.pictures import click_at, finished, opened
from tests.service.support import scene

SHADOW = (28, 27)


def test_dark_pixel_names_its_blocker(open_page: Open, client: httpx2.Client, shoot: Shoot) -> None:
    document = scene()
    document["shapes"][1]["name"] = "red ball"
    page = opened(open_page, finished(client, document))
    click_at(page, *SHADOW)
    expect(page.get_by_role("heading", name="Pixel 28, 27")).to_be_visible()
    reasons = page.locator(".reasons li")
    expect(reasons.first).to_contain_text(
        "This point is unlit: shape 1 red ball blocks all 4 points of light 0 (rectangle)."
    )
    expect(reasons.nth(1)).to_contain_text("Only ambient light is left, 0.1 of the colour.")
    expect(page.locator(".shadows")).to_contain_text("4 blocked by red ball, shape 1")
    # All light from this point is ambient.
    expect(page.get_by_role("row", name=re.compile("Ambient light"))).to_contain_text("100.0 %")
    shoot(page, "inspect-shadow")


@pytest.mark.slow
def test_pointer_shows_its_lines(open_page: Open, client: httpx2.Client) -> None:
    page = opened(open_page, finished(client, scene()))
    click_at(page, *SHADOW)
    page.get_by_role("button", name="/shapes/1").first.click()
    expect(page.locator(".source")).to_contain_text('"type": "ellipsoid"')
    # The scene is written for people, however it was sent.
    [line] = re.findall(r"line (\d+)", page.locator(".source h3").inner_text())
    assert int(line) > 1


@pytest.mark.slow
def test_mirrored_surface(open_page: Open, client: httpx2.Client, shoot: Shoot) -> None:
    document = scene()
    document["materials"]["floor"] |= {"mirror": 0.5}
    page = opened(open_page, finished(client, document), width=360, height=740, color_scheme="dark")
    click_at(page, 40, 36)
    nested = page.locator(".rays .rays")
    expect(nested.locator("summary")).to_have_text(
        re.compile(r"^Mirrored ray .* 50 % of it reaches the camera$")
    )
    expect(page.locator(".reasons")).to_contain_text("A mirror shows what lies before it")
    shoot(page, "inspect-mirror-narrow-dark")
