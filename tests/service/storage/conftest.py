"""A folder and a bucket, which behave the same."""

from itertools import count
from pathlib import Path

import pytest

from service.storage.folder import place_of
from service.storage.objects import Objects
from tests.s3_server import BUCKET

NUMBERS = count()


@pytest.fixture(params=["folder", "bucket"])
def place(request: pytest.FixtureRequest, tmp_path: Path) -> Objects:
    """An empty place of each kind."""
    if request.param == "folder":
        found = place_of(str(tmp_path))
        found.begin("")
        return found
    request.getfixturevalue("object_store")
    return place_of(f"s3://{BUCKET}/places-{next(NUMBERS)}")
