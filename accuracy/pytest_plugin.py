"""The pytest plugin: a fixture ``assert_render_close`` that keeps its pictures with the test's files.

pytest loads it in every environment with this package, so it imports nothing before a test uses it.
"""

from __future__ import annotations

import re
from itertools import count
from pathlib import Path
from typing import TYPE_CHECKING, Any

import pytest

if TYPE_CHECKING:
    from collections.abc import Callable
    from os import PathLike

    from accuracy.comparison import Comparison

OPTION = "--render-differences"
LONGEST_NAME = 100
"""Letters of a folder's name, the last ones of the test's name: file systems allow 255 bytes."""


def pytest_addoption(parser: pytest.Parser) -> None:
    """Add the option that collects pictures of all differences in one place."""
    parser.getgroup("penumbra", "pictures of renderers").addoption(
        OPTION,
        metavar="DIR",
        type=Path,
        help="where assert_render_close writes pictures of differences, in a folder for each test; "
        "by default the test's tmp_path",
    )


@pytest.fixture
def assert_render_close(request: pytest.FixtureRequest) -> Callable[..., Comparison]:
    """The assertion of ``accuracy.comparison``, with pictures of a difference beside the test's other files.

    Those of the first difference of a test are in ``render-difference``, of others in
    ``render-difference-2`` and so on.
    """
    numbers = count(1)

    def check(*pictures: Any, folder: str | PathLike[str] | None = None, **options: Any) -> Comparison:
        __tracebackhide__ = True
        # NumPy and Pillow take longer to load than pytest itself.
        from accuracy.comparison import asserting  # noqa: PLC0415

        found = asserting.compared(*pictures, **options)
        if not found.passed:
            raise AssertionError(asserting.report(found, folder or _folder(request, next(numbers))))
        return found

    return check


def _folder(request: pytest.FixtureRequest, number: int) -> Path:
    given: Path | None = request.config.getoption(OPTION)
    if given is None:
        # Created only now: most tests never need a folder.
        place: Path = request.getfixturevalue("tmp_path") / "render-difference"
    else:
        name = re.sub(r"[^\w.-]+", "-", request.node.nodeid)[-LONGEST_NAME:]
        # Relative to where pytest was started, as its other options are.
        place = request.config.invocation_params.dir / given / name
    return place if number == 1 else place.with_name(f"{place.name}-{number}")
