"""What tests of the ready assignment share."""

from pathlib import Path

import pytest


@pytest.fixture(scope="session")
def keep(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Altered pictures of all submissions here, as those of a class share them."""
    return tmp_path_factory.mktemp("altered")
