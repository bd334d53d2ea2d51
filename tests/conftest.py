"""Shared by all tests: slow tests run last, and hypothesis generates the same examples on every run."""

import pytest
from hypothesis import settings

# A failure on one machine is a failure on all: examples depend on the test alone, and never on the clock.
settings.register_profile("repeatable", derandomize=True, deadline=None, database=None)
settings.load_profile("repeatable")


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Run what answers fast first; the order is otherwise that of collection."""
    items.sort(key=lambda item: item.get_closest_marker("slow") is not None)
