"""The client that blocks is generated from the asynchronous one."""

import inspect
import runpy
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from service.client import AsyncClient, AsyncRemoteJob, Client, RemoteJob

ROOT = Path(__file__).parents[3]

GENERATOR = runpy.run_path(str(ROOT / "tools" / "generate_sync_client.py"))
PAIRS = [(Client, AsyncClient), (RemoteJob, AsyncRemoteJob)]


def methods(kind: type) -> dict[str, Callable[..., Any]]:
    return {
        name: member
        for name, member in inspect.getmembers(kind, inspect.isfunction)
        if member.__module__.startswith("service.client") and (not name.startswith("_") or name == "__init__")
    }


@pytest.mark.parametrize(("source", "target"), GENERATOR["SOURCES"].items())
def test_sync_client_is_generated(source: str, target: str) -> None:
    written = (GENERATOR["CLIENT"] / target).read_text()
    assert written == GENERATOR["generated"](source), "run python tools/generate_sync_client.py"


@pytest.mark.parametrize(("plain", "awaited"), PAIRS, ids=["client", "job"])
def test_async_methods_are_awaited(plain: type, awaited: type) -> None:
    free = {"__init__", "of", "model_post_init"}
    assert len(methods(awaited)) > 10
    for name, method in methods(awaited).items():
        waits = inspect.iscoroutinefunction(method) or inspect.isasyncgenfunction(method)
        assert waits or name in free, name
        assert inspect.isgeneratorfunction(methods(plain)[name]) == inspect.isasyncgenfunction(method), name
