"""Ids are unique, skips can be forbidden, hypothesis repeats its examples, and slow tests are listed."""

import os
from collections import Counter
from collections.abc import Generator

import pytest
from hypothesis import settings

SKIPS_FORBIDDEN = "SKIPS_FORBIDDEN"
"""Set by the build, where what tests need is installed: a test that is skipped there protects nothing."""

FAST_SECONDS = 2.0
"""Of a test that is not marked slow, with its fixtures, on an idle machine."""

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


def pytest_terminal_summary(terminalreporter: pytest.TerminalReporter) -> None:
    """List tests of the fast tier that took long: to be made smaller, or marked slow."""
    reports = [report for name in ("passed", "failed") for report in terminalreporter.getreports(name)]
    called = [report for report in reports if report.when == "call" and "slow" not in report.keywords]
    over = sorted(
        ((each.duration, each.nodeid) for each in called if each.duration > FAST_SECONDS), reverse=True
    )
    if over:
        terminalreporter.section(f"{len(over)} fast tests over {FAST_SECONDS:g} s")
        for seconds, name in over:
            terminalreporter.write_line(f"{seconds:6.1f} s  {name}")
