"""The page of the constants of target quality has a meaning for each."""

import pytest

from tools.docs.generate_constants_reference import MODULES, constants


@pytest.mark.parametrize("module", MODULES)
def test_every_constant_has_a_meaning(module: str) -> None:
    found = list(constants(module))
    assert found
    assert [constant.name for constant in found if not constant.meaning] == []
