"""docs/reference/numerics.md describes every hard case, in the words of tools/docs/numerics_cases.toml."""

import runpy
from typing import Any

import pytest

from accuracy.hard_cases import sections
from benchmarks.stability import COMPARED, OFFSETS, PRICED, WAYS
from tests.architecture.sources import ROOT


@pytest.fixture(scope="module")
def generator() -> dict[str, Any]:
    return runpy.run_path(str(ROOT / "tools" / "docs" / "generate_numerics_reference.py"))


def test_every_case_has_its_texts_and_no_text_is_without_a_case(generator: dict[str, Any]) -> None:
    texts = generator["tomllib"].loads(generator["CASES"].read_text(encoding="utf-8"))
    assert list(texts) == [case.heading for section in sections() for case in section.cases]
    fields = set(generator["TEXTS"].values())
    for heading, text in texts.items():
        assert fields - {"source"} <= text.keys() <= fields, heading


def test_every_case_has_counts_and_none_of_them_is_wrong(generator: dict[str, Any]) -> None:
    counts = generator["json"].loads(generator["COUNTS"].read_text(encoding="utf-8"))
    counted = [(section, case) for section, cases in counts.items() for case in cases]
    assert counted == [(section.title, case.name) for section in sections() for case in section.cases], (
        "run python tools/docs/generate_numerics_reference.py"
    )
    assert {case["wrong"] for cases in counts.values() for case in cases.values()} == {0}


def test_the_page_is_made_of_the_texts_of_the_cases_and_their_counts(generator: dict[str, Any]) -> None:
    page = generator["PAGE"].read_text(encoding="utf-8")
    assert generator["page"]() == page, "run python tools/docs/generate_numerics_reference.py"


def test_the_page_gives_the_price_and_the_errors_of_what_the_benchmark_measures(
    generator: dict[str, Any],
) -> None:
    measured = generator["json"].loads(generator["COSTS"].read_text(encoding="utf-8"))["stability"]
    assert [price["name"] for price in measured["prices"]["pictures"]] == [each.name for each in PRICED]
    assert [(errors["scene"], errors["offset"]) for errors in measured["errors"]] == [
        (setting.scene, offset) for setting in COMPARED for offset in OFFSETS
    ]
    assert generator["WAYS"] == tuple(WAYS)


def test_signs_of_formulas_are_no_markdown(generator: dict[str, Any]) -> None:
    assert generator["marked"]("a*b < c, `x*y`") == r"a\*b \< c, `x*y`"
