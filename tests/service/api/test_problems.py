"""Every exception of the project has a status and a code, and no answer reveals internals."""

import asyncio
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
from tests.service.sending import problem_of

# They are raised in the process of a client or a command, never in that of a running service.
ELSEWHERE = ("service.client", "service.cli", "service.grading", "service.converting", "service.settings")


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


def test_exception_classes_all_have_a_status() -> None:
    found = set(exceptions())
    assert len(found) > 15
    assert found <= set(problems.KINDS)


def ask(error: Exception) -> httpx2.Response:
    """Answers to errors that routes raise."""
    app = FastAPI()
    problems.install(app)

    @app.get("/")
    def fail() -> None:
        raise error

    async def answer() -> httpx2.Response:
        transport = httpx2.ASGITransport(app, raise_app_exceptions=False)
        async with httpx2.AsyncClient(transport=transport, base_url="http://test") as client:
            return await client.get("/")

    return asyncio.run(answer())


@pytest.mark.parametrize(
    "error", [ValueError("secret"), StoreDamagedError("secret"), renderer.RenderError("secret")]
)
def test_internal_error_is_not_revealed(error: Exception) -> None:
    answer = ask(error)
    problem_of(answer, 500)
    assert "secret" not in answer.text


def not_written(limit: str) -> DBAPIError:
    """SQLite's error if it cannot write."""
    with create_engine("sqlite://").connect() as connection:
        connection.exec_driver_sql("CREATE TABLE pictures (pixels BLOB)")
        connection.exec_driver_sql(limit)
        with pytest.raises(DBAPIError) as caught:
            connection.exec_driver_sql("INSERT INTO pictures VALUES (zeroblob(100000))")
    return caught.value


@pytest.mark.parametrize(
    ("error", "status", "code"),
    [
        (UnavailableError("Busy."), 503, "unavailable"),
        (not_written("PRAGMA max_page_count = 4"), 507, "store_full"),
        (not_written("PRAGMA query_only = ON"), 503, "store_read_only"),
    ],
    ids=["busy", "full disk", "read-only disk"],
)
def test_passing_trouble_says_when_to_try_again(error: Exception, status: int, code: str) -> None:
    answer = ask(error)
    assert problem_of(answer, status)["code"] == code
    assert int(answer.headers["Retry-After"]) > 0


def test_scene_error_lists_fifty_problems_and_counts_the_rest() -> None:
    answer = ask(renderer.SceneError([Problem(pointer="/x", detail="Wrong.", code="wrong")] * 60))
    found = problem_of(answer, 422)
    assert (len(found["errors"]), found["more"]) == (50, 10)
