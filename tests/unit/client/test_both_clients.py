"""The client that waits and the one that is awaited offer the same."""

from __future__ import annotations

import inspect
import subprocess
import sys
from collections.abc import Callable
from typing import Any

import pytest

from service.client import AsyncClient, AsyncRemoteJob, Client, RemoteJob

PAIRS = [(Client, AsyncClient), (RemoteJob, AsyncRemoteJob)]


def methods(kind: type) -> dict[str, Callable[..., Any]]:
    return {
        name: member
        for name, member in inspect.getmembers(kind, inspect.isfunction)
        if member.__module__.startswith("service.client") and (not name.startswith("_") or name == "__init__")
    }


@pytest.mark.parametrize(("plain", "awaited"), PAIRS, ids=["client", "job"])
def test_both_have_the_same_methods_with_the_same_parameters(plain: type, awaited: type) -> None:
    ours, theirs = methods(plain), methods(awaited)
    assert len(ours) > 10
    for name, method in ours.items():
        here, there = inspect.signature(method).parameters, inspect.signature(theirs[name]).parameters
        assert [(one.name, one.kind, one.default) for one in here.values()] == [
            (one.name, one.kind, one.default) for one in there.values()
        ], name
    assert set(ours) == set(theirs)


@pytest.mark.parametrize(("plain", "awaited"), PAIRS, ids=["client", "job"])
def test_whatever_asks_the_service_is_awaited(plain: type, awaited: type) -> None:
    free = {"__init__", "of", "model_post_init"}
    for name, method in methods(awaited).items():
        waits = inspect.iscoroutinefunction(method) or inspect.isasyncgenfunction(method)
        assert waits or name in free, name
        assert inspect.isgeneratorfunction(methods(plain)[name]) == inspect.isasyncgenfunction(method), name


def test_clients_start_without_what_only_some_uses_of_them_need() -> None:
    rest = ("renderer", "PIL", "fastapi", "sqlalchemy", "uvicorn", "typer", "rich", "IPython", "matplotlib")
    probe = f"import sys, service.client; print(*(name for name in {rest} if name in sys.modules))"
    done = subprocess.run([sys.executable, "-c", probe], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == ""
