"""Ids are unique, skips can be forbidden, and hypothesis generates the same examples on every run."""

import os
from collections import Counter
from collections.abc import Generator

import pytest
from hypothesis import settings

SKIPS_FORBIDDEN = "SKIPS_FORBIDDEN"
"""Set by the build, where what tests need is installed: a test that is skipped there protects nothing."""

# A failure on one machine is a failure on all: examples depend on the test alone, and never on the clock.
settings.register_profile("repeatable", derandomize=True, deadline=None, database=None)
settings.load_profile("repeatable")


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Refuse tests that share an id: of these, pytest-xdist would run one alone."""
    shared = [name for name, count in Counter(item.nodeid for item in items).items() if count > 1]
    if shared:
        raise pytest.UsageError(f"Several tests have one id: {', '.join(shared)}.")


@pytest.hookimpl(wrapper=True)
def pytest_runtest_makereport(
    item: pytest.Item, call: pytest.CallInfo[None]
) -> Generator[None, pytest.TestReport, pytest.TestReport]:
    """Call a skipped test failed where that is forbidden; one that is expected to fail is not skipped."""
    report = yield
    if report.skipped and not hasattr(report, "wasxfail") and os.environ.get(SKIPS_FORBIDDEN):
        reason = report.longrepr[2] if isinstance(report.longrepr, tuple) else report.longrepr
        report.outcome = "failed"
        report.longrepr = (
            f"{reason}. {SKIPS_FORBIDDEN} is set, so that this is an error: install what is missing."
        )
    return report
