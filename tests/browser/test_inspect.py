"""The inspector in the browser: why a pixel is dark, what each light adds, which part of the scene."""

import itertools
import re

import httpx2
import pytest
from playwright.sync_api import expect

from tests.browser.conftest import Open, Shoot
from tests.browser.pictures import click_at, finished, opened
from tests.service.support import scene

SHADOW = (28, 27)
# Left and right ends of the labels below a plot, whose axis has ticks at 0.8, 0.9, 1, 1.5, 2, 3 and 4.
LABELS = """async () => {
    const { makePlot } = await import("/web/plots.js");
    const plot = makePlot({ label: "", xLabel: "seconds", yLabel: "error" });
    document.querySelector(".drawer-render").append(plot.element);
    plot.draw([0.8, 4.1].map((x) => ({ x, y: 1 / x, low: 0.5 / x, high: 2 / x })), null, []);
    const ends = Array.from(plot.element.querySelectorAll(".below"), (label) => {
        const { left, right } = label.getBoundingClientRect();
        return [left, right];
    });
    return ends.sort(([a], [b]) => a - b);
}"""


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
def test_pointer_shows_its_part(open_page: Open, client: httpx2.Client) -> None:
    page = opened(open_page, finished(client, scene()))
    click_at(page, *SHADOW)
    page.get_by_role("button", name="/shapes/1").first.click()
    expect(page.locator(".source")).to_contain_text('"type": "ellipsoid"')
    # The text is not the one that was sent, so its lines have no numbers.
    expect(page.locator(".source h3")).to_have_text("Scene, /shapes/1")


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
    widths = page.locator(".amount").evaluate_all("(bars) => bars.map((bar) => bar.clientWidth)")
    assert len(widths) > 2
    assert len(set(widths)) == 1
    shoot(page, "inspect-mirror-narrow-dark")


@pytest.mark.slow
def test_labels_of_a_plot_do_not_overlap(open_page: Open, client: httpx2.Client) -> None:
    page = opened(open_page, finished(client, scene()))
    # Passes without an estimate of the error make no table.
    expect(page.get_by_text("do not show how far")).to_be_visible()
    expect(page.get_by_text("Show table")).to_be_hidden()
    labels = page.evaluate(LABELS)
    assert len(labels) > 2
    assert all(end < start for (_, end), (start, _) in itertools.pairwise(labels))
