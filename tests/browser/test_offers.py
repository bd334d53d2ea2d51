"""Offers of a quote that the page calls better, and its text for an unknown error."""

import json
from typing import Any

import httpx2
import pytest
from playwright.sync_api import Page, Route, expect

from tests.browser.scenes import TIMEOUT, opened, render_button, small, write

ALTERNATIVES = """async ([offers, asked]) => {
  const { alternatives } = await import("/web/views/start/offers.js");
  return alternatives(offers, asked).map(([text, { quality }]) => [text, quality.antialiasing.pattern,
    quality.antialiasing.samples]);
}"""


def offer(
    pattern: str, samples: int, *, seconds: float, error: tuple[float, float, float] | None
) -> dict[str, Any]:
    predicted = error and dict(zip(("estimate", "low", "high"), error, strict=True))
    quality = {
        "mode": "fixed",
        "antialiasing": {"pattern": pattern, "samples": samples},
        "light": {"pattern": "sobol", "samples": 4},
    }
    return {"quality": quality, "seconds": {"estimate": seconds}, "error": predicted}


ASKED = offer("random", 16, seconds=4.0, error=(0.01, 0.005, 0.02))


def alternatives(page: Page, *offers: dict[str, Any]) -> list[list[Any]]:
    found: list[list[Any]] = page.evaluate(ALTERNATIVES, [[*offers, ASKED], ASKED])
    return found


@pytest.mark.slow
def test_half_the_error_beyond_noise(bare_page: Page) -> None:
    noisy = offer("sobol", 4, seconds=3.9, error=(0.004, 0.0, 0.03))
    clear = offer("sobol", 16, seconds=5.0, error=(0.004, 0.003, 0.005))
    assert alternatives(bare_page, noisy) == []
    assert alternatives(bare_page, noisy, clear) == [["Half the error", "sobol", 16]]


@pytest.mark.slow
@pytest.mark.parametrize(
    ("seconds", "error", "name"),
    [
        (65.0, 0.00124, "1/8 of the error"),
        (2.0, 0.003, "Cheaper and better: a third of the error"),
        (2.0, 0.007, "Cheaper and better: a smaller error"),
        (2.0, 0.009, "The same error, sooner"),
        (3.9, 0.009, None),
    ],
)
def test_offer_is_named_by_its_error(bare_page: Page, seconds: float, error: float, name: str | None) -> None:
    other = offer("sobol", 16, seconds=seconds, error=(error, error, error))
    assert [text for text, *_ in alternatives(bare_page, other)] == ([name] if name else [])


@pytest.mark.slow
def test_time_limit_holds_where_fixed_samples_seem_better(page: Page, client: httpx2.Client) -> None:
    fixed = offer("sobol", 204, seconds=11.0, error=(0.001, 0.0005, 0.002))
    fixed["seconds"] |= {"low": 5.0, "high": 20.0}

    def with_fixed(route: Route) -> None:
        answer = route.fetch()
        quote = answer.json() | {"for_seconds": fixed, "offers": []}
        quote["asked"] = quote["asked"] or fixed | {"quality": {"mode": "target", "error": 0.001}}
        route.fulfill(response=answer, body=json.dumps(quote))

    page.route("**/v1/quotes", with_fixed)
    opened(page)
    write(page, small("basic", name="within 12 s"))
    page.get_by_role("radio", name="Time").check()
    page.get_by_label("Time limit (s)").fill("12")
    use = page.get_by_role("button", name="Use: Fixed samples, without a limit")
    expect(use).to_be_visible(timeout=TIMEOUT)
    render_button(page).click()
    page.wait_for_url("**/jobs/*", timeout=TIMEOUT)
    quality = client.get(f"/v1/jobs/{page.url.rsplit('/', 1)[1]}/request").json()["quality"]
    assert (quality["mode"], quality["time_limit"]) == ("target", 12)
    page.unroute_all(behavior="ignoreErrors")


@pytest.mark.slow
def test_unknown_error_has_its_reason(page: Page) -> None:
    """The answer that a busy machine gives; which errors a pilot has time for is chance."""
    reason = "Only 96 pixels were sampled, too few to estimate an error: edges may lie between them."

    def without_errors(route: Route) -> None:
        answer = route.fetch()
        quote = answer.json()
        quote["asked"] = quote["asked"] or offer("random", 16, seconds=1.0, error=None)
        quote["asked"]["seconds"] = {"estimate": 1.0, "low": 0.5, "high": 2.0}
        quote["asked"] |= {"error": None, "error_unknown": reason}
        route.fulfill(response=answer, body=json.dumps(quote | {"offers": []}))

    page.route("**/v1/quotes", without_errors)
    opened(page)
    write(page, small("basic", name="nearly flat"))
    shown = page.get_by_role("region", name="Quote")
    expect(shown).to_contain_text(reason, timeout=TIMEOUT)
    expect(shown).to_contain_text("not known")
    expect(shown.get_by_role("button", name="Try again")).to_be_visible()
    # The page may be asking once more: that answer comes after the page is closed.
    page.unroute_all(behavior="ignoreErrors")
