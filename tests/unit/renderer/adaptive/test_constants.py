"""The page of the constants of target quality: up to date, and with a meaning for each."""

import runpy
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[4]
GENERATOR = runpy.run_path(str(ROOT / "tools" / "docs" / "generate_constants_reference.py"))


def test_the_page_of_the_constants_is_up_to_date() -> None:
    page = (ROOT / "docs" / "reference" / "constants.md").read_text(encoding="utf-8")
    assert page == GENERATOR["page"](), "run python tools/docs/generate_constants_reference.py"


@pytest.mark.parametrize("module", GENERATOR["MODULES"])
def test_every_constant_has_a_meaning(module: str) -> None:
    found = list(GENERATOR["constants"](module))
    assert found
    assert [constant.name for constant in found if not constant.meaning] == []
