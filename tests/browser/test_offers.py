"""Offers of a quote that the page calls better, and its text for an unknown error."""

import json
from typing import Any

import pytest
from playwright.sync_api import Page, Route, expect

from tests.browser.scenes import TIMEOUT, opened, small, write

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
