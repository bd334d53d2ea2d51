"""The page of the constants of target quality has a meaning for each."""

import runpy
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[4]
GENERATOR = runpy.run_path(str(ROOT / "tools" / "docs" / "generate_constants_reference.py"))


@pytest.mark.parametrize("module", GENERATOR["MODULES"])
def test_every_constant_has_a_meaning(module: str) -> None:
    found = list(GENERATOR["constants"](module))
    assert found
    assert [constant.name for constant in found if not constant.meaning] == []
