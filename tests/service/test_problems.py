"""Every exception of the project has an answer, and no answer reveals internals."""

from __future__ import annotations

import importlib
import pkgutil
from collections.abc import Iterator

import httpx2
import pytest
from fastapi import FastAPI
from sqlalchemy import create_engine
from sqlalchemy.exc import DBAPIError

import renderer
import schemas
import service
from schemas.errors import Problem
from service.api import problems
from service.errors import StoreDamagedError, UnavailableError

# They are raised in the process of a client or a command, never in that of a running service.
ELSEWHERE = (
    "service.client",
    "service.cli",
    "service.grading",
    "service.converting",
    "service.settings",
)


def exceptions() -> Iterator[type[Exception]]:
    """All exception classes that the project defines, but those that are caught in their own module."""
    for package in (schemas, renderer, service):
        for found in pkgutil.walk_packages(package.__path__, package.__name__ + "."):
            if found.name.startswith(ELSEWHERE) or found.name.endswith((".env", "__main__")):
                continue
            module = importlib.import_module(found.name)
            for value in vars(module).values():
                if (
                    isinstance(value, type)
                    and issubclass(value, Exception)
                    and value.__module__ == found.name
                    and not value.__name__.startswith("_")
                ):
                    yield value


def test_every_exception_of_the_project_is_in_the_table() -> None:
    found = set(exceptions())
    assert len(found) > 15
    assert {error.__qualname__ for error in found} <= {error.__qualname__ for error in problems.KINDS}
    assert found <= set(problems.KINDS)


async def ask(error: Exception) -> httpx2.Response:
    app = FastAPI()
    problems.install(app)

    @app.get("/")
    def fail() -> None:
        raise error

    transport = httpx2.ASGITransport(app, raise_app_exceptions=False)
    async with httpx2.AsyncClient(transport=transport, base_url="http://test") as client:
        return await client.get("/")


@pytest.fixture
def anyio_backend() -> str:
    return "asyncio"


@pytest.mark.anyio
@pytest.mark.parametrize(
    "error", [ValueError("secret"), StoreDamagedError("secret"), renderer.RenderError("secret")]
)
async def test_internal_errors_are_not_revealed(error: Exception) -> None:
    answer = await ask(error)
    assert answer.status_code == 500
    assert answer.headers["Content-Type"] == problems.MEDIA_TYPE
    assert "secret" not in answer.text


@pytest.mark.anyio
async def test_what_may_work_later_says_when_to_try_again() -> None:
    answer = await ask(UnavailableError("Busy."))
    assert (answer.status_code, answer.json()["detail"]) == (503, "Busy.")
    assert int(answer.headers["Retry-After"]) > 0


def not_written(limit: str) -> DBAPIError:
    """What SQLite says where it cannot write."""
    with create_engine("sqlite://").connect() as connection:
        connection.exec_driver_sql("CREATE TABLE pictures (pixels BLOB)")
        connection.exec_driver_sql(limit)
        with pytest.raises(DBAPIError) as caught:
            connection.exec_driver_sql("INSERT INTO pictures VALUES (zeroblob(100000))")
    return caught.value


@pytest.mark.anyio
@pytest.mark.parametrize(
    ("limit", "status", "code"),
    [
        ("PRAGMA max_page_count = 4", 507, "store_full"),
        ("PRAGMA query_only = ON", 503, "store_read_only"),
    ],
)
async def test_a_database_on_a_disk_that_cannot_be_written_is_reported_as_the_disk(
    limit: str, status: int, code: str
) -> None:
    answer = await ask(not_written(limit))
    assert (answer.status_code, answer.json()["code"]) == (status, code)
    assert "Try again when" in answer.json()["detail"]
    assert int(answer.headers["Retry-After"]) > 0


@pytest.mark.anyio
async def test_the_problems_of_a_scene_are_listed() -> None:
    answer = await ask(renderer.SceneError([Problem(pointer="/x", detail="Wrong.", code="wrong")] * 60))
    assert (answer.status_code, len(answer.json()["errors"]), answer.json()["more"]) == (422, 50, 10)
