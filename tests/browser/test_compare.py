"""The comparison of two pictures in the browser."""

import re
from collections.abc import Iterator

import httpx2
import numpy as np
import pytest
from playwright.sync_api import Page, expect

from service.server import RunningServer
from tests.browser.conftest import Open, Shoot
from tests.browser.pictures import click_at, codes_of, finished, point_at, served, tab
from tests.service.support import image, scene

PLACES = """async ([verdict, shares]) => {
  const { makeDetails } = await import("/web/views/compare/verdict.js");
  const region = { x0: 0, x1: 8, y0: 0, y1: 8, rmse: 0.1, brightness: -0.2 };
  const worst_regions = shares.map((share) => ({ ...region, share }));
  const details = makeDetails({ verdict, worst_regions, diagnosis: [], metrics: {} }, { worst: null });
  return Array.from(details.querySelectorAll("li p"), ({ textContent }) => textContent.split("; ")[1]);
}"""


@pytest.fixture(scope="module")
def pair(server: RunningServer) -> Iterator[tuple[str, str]]:
    """A floor alone, and a floor with a ball."""
    with httpx2.Client(base_url=server.url, timeout=60) as client:
        yield finished(client, scene() | {"shapes": scene()["shapes"][:1]}), finished(client)


def test_verdict_and_worst_region(open_page: Open, pair: tuple[str, str], shoot: Shoot) -> None:
    page = open_page("/compare/{}/{}".format(*pair))
    expect(page.locator(".verdict")).to_contain_text("Not the same")
    shoot(page, "compare-split")
    before = page.locator("canvas.pixels").bounding_box()
    page.get_by_role("button", name=re.compile("Region 1: ellipsoid")).click()
    after = page.locator("canvas.pixels").bounding_box()
    assert before is not None
    assert after is not None
    assert after["width"] > 1.5 * before["width"]
    page.get_by_label("Shown").select_option("Difference")
    expect(page.get_by_label("Highest value")).to_have_value("0.25")
    shoot(page, "compare-region")


@pytest.mark.slow
def test_regions_without_a_share(bare_page: Page) -> None:
    shares = [0.74, 0.004, 0.0001]
    listed = [f"{share}\N{NO-BREAK SPACE}% of the squared difference" for share in ("74", "0.4", "< 0.1")]
    # Those of a mismatch are beyond noise, however small.
    assert bare_page.evaluate(PLACES, ["mismatch", shares]) == listed
    assert bare_page.evaluate(PLACES, ["noisy_match", shares]) == listed[:2]


@pytest.mark.slow
def test_pixel_of_both_pictures(open_page: Open, client: httpx2.Client, pair: tuple[str, str]) -> None:
    page = open_page("/compare/{}/{}".format(*pair))
    expect(page.locator(".verdict")).to_be_visible()
    click_at(page, 36, 24)
    for name, job in zip("AB", pair, strict=True):
        section = page.get_by_role("region", name=f"Pixel 36, 24 of {name}")
        answer = client.post(f"/v1/jobs/{job}/inspections", json={"x": 36, "y": 24}).json()
        expect(section.locator(".reasons li").first).to_contain_text(
            answer["reasons"][0]["text"].split("`")[0]
        )
    values = [image(client, job)[24, 36].astype(np.float64) for job in pair]
    numbers = [
        [float(word.replace("\N{MINUS SIGN}", "-")) for word in line.split()[-3:]]
        for line in page.locator(".readout").inner_text().splitlines()[1:]
    ]
    # The readout shows four digits.
    np.testing.assert_allclose(numbers, [*values, values[0] - values[1]], rtol=1e-3)
    # The pixel with the largest difference is shown where it is.
    difference = np.abs(np.subtract(*(np.clip(image(client, job), 0, 1) for job in pair))).max(axis=2)
    row, column = np.unravel_index(difference.argmax(), difference.shape)
    tab(page, "Verdict")
    page.get_by_role("button", name="at pixel").click()
    expect(page.locator(".why h2").first).to_contain_text(f"Pixel {column}, {row} of")
    expect(page.locator(".readout")).to_contain_text(f"{column}, {row}")
    page.get_by_role("button", name="Fit").click()
    # On the side of B its answer comes first.
    click_at(page, 60, 30)
    expect(page.locator(".why h2").first).to_have_text("Pixel 60, 30 of B")


@pytest.mark.slow
def test_jobs_and_scenes_side_by_side(open_page: Open, client: httpx2.Client, pair: tuple[str, str]) -> None:
    page = open_page("/compare/{}/{}".format(*pair), width=1440)
    expect(page.locator(".verdict")).to_be_visible()
    expect(page.get_by_role("listitem").filter(has_text="Region 1")).to_contain_text("than B by")
    sides = page.locator(".sides").first
    cells = sides.get_by_role("row", name="CPU time").get_by_role("cell").all_inner_texts()
    # The table shows two digits.
    assert [float(cell.split()[0]) for cell in cells] == pytest.approx(
        [client.get(f"/v1/jobs/{job}").json()["cost"]["cpu_seconds"] for job in pair], rel=0.06
    )
    tab(page, "Scenes")
    expect(page.get_by_role("tabpanel", name="Scenes").locator("tbody tr")).to_have_count(1)
    expect(page.get_by_role("row", name="/shapes/1")).to_contain_text("ellipsoid")


@pytest.mark.slow
def test_qualities_are_told_apart(open_page: Open, client: httpx2.Client, shoot: Shoot) -> None:
    # No other picture has this size.
    few, many = (scene(40, 30, samples=count, light_samples=1) | {"name": "twice"} for count in (1, 4))
    first = finished(client, few)
    page = open_page(f"/jobs/{first}?tab=compare", width=1440)
    hint = page.get_by_text("Change and render again with another quality, then compare here.")
    expect(hint).to_be_visible()
    second = finished(client, many)
    tab(page, "Render")
    tab(page, "Compare")
    expect(hint).to_be_hidden()
    expect(page.get_by_label("Compare with").get_by_role("option").first).to_have_text(
        re.compile(r"^twice: 4 × \w+, light 1 × \w+; .*[0-9].*; just now$")
    )
    shoot(page, "compare-choice")
    page.get_by_label("Compare with").select_option(second)
    page.get_by_role("button", name="Compare", exact=True).click()
    name = re.compile(r"Compare 1 × \w+, light 1 × \w+ with 4 × \w+, light 1 × \w+")
    expect(page.get_by_role("heading", level=1)).to_have_text(name)
    expect(page).to_have_title(name)
    expect(page.locator(".verdict")).to_be_visible()
    page.get_by_label("Shown").select_option("Displayed difference")
    shoot(page, "compare-qualities")


@pytest.mark.slow
def test_another_picture_after_a_refusal(
    open_page: Open, client: httpx2.Client, pair: tuple[str, str]
) -> None:
    gone = finished(client, scene() | {"name": "gone"})
    page = open_page(f"/jobs/{pair[0]}")
    tab(page, "Compare")
    page.get_by_label("Compare with").select_option(gone)
    client.delete(f"/v1/jobs/{gone}")
    page.get_by_role("button", name="Compare", exact=True).click()
    expect(page.get_by_role("alert")).to_be_visible()
    later = finished(client, scene() | {"name": "later"})
    tab(page, "Pixel")
    tab(page, "Verdict")
    page.get_by_label("Compare with").select_option(later)
    page.get_by_role("button", name="Compare", exact=True).click()
    expect(page.locator(".verdict")).to_contain_text("Not the same")


@pytest.mark.slow
def test_line_between_two_pictures(open_page: Open, client: httpx2.Client, pair: tuple[str, str]) -> None:
    page = open_page("/compare/{}/{}".format(*pair))
    expect(page.get_by_label("Shown")).to_be_enabled()
    page.get_by_role("button", name="Display").click()
    page.get_by_label("Line between A and B").fill("25")
    one, other = (served(client, job) for job in pair)
    codes = codes_of(page)
    np.testing.assert_array_equal(codes[:, :20], one[:, :20])
    np.testing.assert_array_equal(codes[:, 20:], other[:, 20:])


def choose_reference(page: Page, kind: str, content: bytes) -> None:
    page.get_by_label("Reference: a PNG, NPY or EXR file").set_input_files(
        {"name": f"reference.{kind}", "mimeType": "application/octet-stream", "buffer": content}
    )
    page.get_by_role("button", name="Compare").first.click()


@pytest.mark.slow
@pytest.mark.parametrize("kind", ["png", "npy", "exr"])
def test_file_as_the_reference(
    open_page: Open, client: httpx2.Client, pair: tuple[str, str], kind: str
) -> None:
    page = open_page(f"/compare/{pair[0]}/file")
    content = client.get(f"/v1/jobs/{pair[1]}/image.{kind}").content
    choose_reference(page, kind, content)
    expect(page.locator(".verdict")).to_contain_text("Not the same")
    page.get_by_label("Shown").select_option("b")
    np.testing.assert_array_equal(codes_of(page), served(client, pair[1]))


VIRIDIS_BEGIN = [68, 1, 84]


@pytest.mark.slow
@pytest.mark.parametrize("kind", ["npy", "png"])
def test_picture_brighter_than_white(open_page: Open, client: httpx2.Client, kind: str) -> None:
    bright = scene(40, 24, samples=1, light_samples=1) | {"ambient": [30, 30, 30]}
    job = finished(client, bright)
    assert image(client, job).max() > 2
    page = open_page(f"/compare/{job}/file")
    choose_reference(page, kind, client.get(f"/v1/jobs/{job}/image.{kind}").content)
    expect(page.locator(".verdict")).to_contain_text("The same")
    page.get_by_label("Shown").select_option("Difference")
    point_at(page, 20, 22, (40, 24))
    a, b = (line[2:] for line in page.locator(".readout").inner_text().splitlines()[1:3])
    if kind == "npy":
        assert a == b
        assert (codes_of(page) == VIRIDIS_BEGIN).all()
    else:
        # Eight bits hold no more than white, so the page says that.
        assert max(float(word) for word in b.split()) == 1
        expect(
            page.get_by_text("B is shown with 8 bits a channel and nothing outside 0 to 1.")
        ).to_be_visible()


@pytest.mark.slow
def test_refused_file_is_replaced(open_page: Open, client: httpx2.Client, pair: tuple[str, str]) -> None:
    page = open_page(f"/compare/{pair[0]}/file")
    choose_reference(page, "exr", b"not a picture")
    expect(page.get_by_role("alert")).to_have_text(
        "reference is not a PNG, NPY or EXR file. Save the picture as one of these."
    )
    choose_reference(page, "npy", client.get(f"/v1/jobs/{pair[1]}/image.npy").content)
    expect(page.locator(".verdict")).to_contain_text("Not the same")
