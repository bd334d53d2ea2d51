from pathlib import Path

import pytest

from tests.service.grading.assignments import Assignment


@pytest.fixture
def assignment(tmp_path: Path) -> Assignment:
    """An assignment, and a submission with only the scene."""
    return Assignment.of(tmp_path)
