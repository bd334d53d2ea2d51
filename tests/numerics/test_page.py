"""The pages about numerics describe every hard case, in the words of tools/docs/numerics_cases.toml."""

import doctest
import json
import math
import re
from fractions import Fraction
from typing import Any

import numpy as np
import pytest

from accuracy.hard_cases import sections
from accuracy.hard_cases.harness import DIGITS
from benchmarks.stability import COMPARED, OFFSETS, PRICED
from tools.docs import figures
from tools.docs import generate_numerics_reference as generator

CASES = [case for section in sections() for case in section.cases]
IMPORTED = {"json": json, "math": math, "np": np, "Fraction": Fraction}
"""What the page of results says that its lines of Python need."""


@pytest.fixture(scope="module")
def texts() -> dict[str, dict[str, str]]:
    return generator.read(generator.CASES)


def test_every_case_has_its_texts_and_no_text_is_without_a_case(texts: dict[str, dict[str, str]]) -> None:
    assert list(texts) == [case.heading for case in CASES]
    needed = {"symptom", "cause", "remedy", "expected"}
    for heading, text in texts.items():
        assert needed <= text.keys() <= needed | {"example", "source"}, heading


def test_every_case_has_counts_and_none_of_them_is_wrong() -> None:
    counts = figures.read("hard_cases")
    counted = [(section, case) for section, cases in counts.items() for case in cases]
    assert counted == [(section.title, case.name) for section in sections() for case in section.cases], (
        "run python -m tools.docs.generate_numerics_reference"
    )
    assert {case["wrong"] for cases in counts.values() for case in cases.values()} == {0}


def test_the_pages_are_made_of_the_texts_of_the_cases_and_their_counts() -> None:
    written = generator.pages()
    assert set(written) == {generator.PAGE, *generator.FOLDER.iterdir()}
    assert {path: path.read_text(encoding="utf-8") for path in written} == written, (
        "run python -m tools.docs.write_pages"
    )


@pytest.mark.parametrize("case", CASES, ids=lambda case: case.heading)
def test_the_lines_of_python_of_a_case_give_what_the_page_shows(
    case: Any, texts: dict[str, dict[str, str]]
) -> None:
    example = texts[case.heading].get("example", "")
    parsed = doctest.DocTestParser().get_doctest(example, dict(IMPORTED), case.heading, None, None)
    with np.errstate(all="ignore"):
        result = doctest.DocTestRunner(verbose=False).run(parsed)
    assert (result.failed, result.attempted) == (0, example.count(">>> "))


def test_every_page_gives_the_precision_that_the_exact_answers_have() -> None:
    found = {
        number
        for text in generator.pages().values()
        for number in re.findall(r"(\d+) (?:decimal )?digits", text)
    }
    assert found == {str(DIGITS)}


def test_each_source_of_the_list_is_one_of_a_case(texts: dict[str, dict[str, str]]) -> None:
    named = {name for text in texts.values() for name in text.get("source", "").split("; ")}
    assert generator.read(generator.SECTION_TEXTS)["sources"].keys() <= named


def test_each_hard_scene_is_on_the_page_of_one_section() -> None:
    about = generator.read(generator.SECTION_TEXTS)
    shown = [name for section in sections() for name in about[section.title].get("pictures", [])]
    assert sorted(shown) == sorted(path.stem for path in generator.SCENES.glob("*.json"))


def test_the_page_gives_the_price_and_the_errors_of_what_the_benchmark_measures() -> None:
    measured = figures.read("stability")["stability"]
    assert [price["name"] for price in measured["prices"]["pictures"]] == [each.name for each in PRICED]
    assert [(errors["scene"], errors["offset"]) for errors in measured["errors"]] == [
        (setting.scene, offset) for setting in COMPARED for offset in OFFSETS
    ]


def test_signs_of_formulas_are_no_markdown() -> None:
    assert generator.marked("a*b < c, `x*y`") == r"a\*b \< c, `x*y`"
