"""The client that blocks is generated from the asynchronous one."""

from __future__ import annotations

import inspect
import runpy
import subprocess
import sys
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
def test_the_client_that_blocks_is_what_its_generator_makes(source: str, target: str) -> None:
    written = (GENERATOR["CLIENT"] / target).read_text()
    assert written == GENERATOR["generated"](source), "run python tools/generate_sync_client.py"


@pytest.mark.parametrize(("plain", "awaited"), PAIRS, ids=["client", "job"])
def test_whatever_asks_the_service_is_awaited(plain: type, awaited: type) -> None:
    free = {"__init__", "of", "model_post_init"}
    assert len(methods(awaited)) > 10
    for name, method in methods(awaited).items():
        waits = inspect.iscoroutinefunction(method) or inspect.isasyncgenfunction(method)
        assert waits or name in free, name
        assert inspect.isgeneratorfunction(methods(plain)[name]) == inspect.isasyncgenfunction(method), name


def test_clients_start_without_what_only_some_uses_of_them_need() -> None:
    rest = ("renderer", "PIL", "fastapi", "sqlalchemy", "uvicorn", "typer", "rich", "IPython", "matplotlib")
    probe = f"import sys, service.client; print(*(name for name in {rest} if name in sys.modules))"
    done = subprocess.run([sys.executable, "-c", probe], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == ""
