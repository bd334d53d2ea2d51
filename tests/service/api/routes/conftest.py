"""A finished job that many tests look at."""

import pytest

from tests.service.in_process import InProcess
from tests.service.support import finish, scene, submit


@pytest.fixture(scope="session")
def done(local: InProcess) -> str:
    """A job of `scene()` with two layers."""
    with local.client() as client:
        job: str = finish(client, submit(client, scene(), layers=["depth", "shape"]))["id"]
    return job
