"""The inspector in the browser: why a pixel is dark, what each light adds, which lines of the scene."""

from __future__ import annotations

import json
import re

import httpx2
from playwright.sync_api import expect

from tests.browser.conftest import Open, Shoot
from tests.browser.pictures import click_at, finished, opened
from tests.service.support import finish, image, scene

SHADOW = (28, 27)


def test_a_dark_pixel_says_what_stands_before_the_light(
    open_page: Open, client: httpx2.Client, shoot: Shoot
) -> None:
    document = scene()
    document["shapes"][1]["name"] = "red ball"
    page = opened(open_page, finished(client, document))
    click_at(page, *SHADOW)
    expect(page.get_by_role("heading", name="Pixel 28, 27")).to_be_visible()
    reasons = page.locator(".reasons li")
    expect(reasons.first).to_contain_text(
        "Nothing lights it: shape 1 red ball lies between it and light 0 from all 4 points."
    )
    expect(reasons.nth(1)).to_contain_text("Only ambient light is left, 0.1 of the colour.")
    expect(page.locator(".shadows")).to_contain_text("4 blocked by red ball, shape 1")
    # All light from this point is ambient.
    expect(page.get_by_role("row", name=re.compile("Ambient light"))).to_contain_text("100.0 %")
    shoot(page, "inspect-shadow")


def test_a_pointer_shows_its_lines_of_the_scene(open_page: Open, client: httpx2.Client) -> None:
    text = json.dumps({"scene": scene()}, indent=2)
    headers = {"Content-Type": "application/json"}
    job = client.post("/v1/jobs", content=text, headers=headers).json()["id"]
    finish(client, job)
    page = opened(open_page, job)
    click_at(page, *SHADOW)
    page.get_by_role("button", name="/shapes/1").first.click()
    expect(page.locator(".source")).to_contain_text('"type": "ellipsoid"')
    line = int(re.findall(r"line (\d+)", page.locator(".source h3").inner_text())[0])
    # The scene begins on the second line of the body.
    assert '"ellipsoid"' in text.splitlines()[line + 1]


def test_the_colours_of_the_ray_and_of_the_picture_stand_beside_each_other(
    open_page: Open, client: httpx2.Client
) -> None:
    job = finished(client)
    page = opened(open_page, job)
    click_at(page, 40, 40)
    cells = page.locator(".colours tbody tr").nth(1).locator("td")
    expect(cells.first).to_be_visible()
    shown = [float(text) for text in cells.all_inner_texts()]
    assert shown == [float(f"{value:.4g}") for value in image(client, job)[40, 40]]


def test_what_a_mirror_shows_hangs_below_it(open_page: Open, client: httpx2.Client, shoot: Shoot) -> None:
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


def test_parts_are_sorted_by_what_they_add_to_the_pixel_and_parts_of_nothing_are_hidden(
    open_page: Open, client: httpx2.Client
) -> None:
    document = scene()
    # A highlight of nearly nothing on glass, through which the background is seen.
    document["materials"]["ball"] = {
        "type": "phong", "color": [0, 0, 0], "ambient": 0, "diffuse": 0, "specular": 1, "shininess": 400,
        "transmission": 1, "ior": 1.5,
    }  # fmt: skip
    page = opened(open_page, finished(client, document))
    click_at(page, 40, 24)
    rows = page.locator(".parts").first.locator("tbody tr")
    expect(rows.first).to_contain_text("Refracted ray")
    shares = [
        float(text.split()[0])
        for text in page.locator(".parts").first.locator("td:nth-child(2)").all_inner_texts()
    ]
    assert shares == sorted(shares, reverse=True)
    assert min(shares) > 0
    assert sum(shares) > 99
    expect(page.locator(".reasons li").first).to_contain_text("Glass shows what lies behind it")
    expect(page.locator(".reasons")).not_to_contain_text("fully visible")
