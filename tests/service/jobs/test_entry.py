"""Entering a job: how long others wait for it."""

import asyncio
import json
import re
from contextlib import ExitStack
from itertools import count, pairwise
from pathlib import Path
from typing import Any

import pytest
from sqlalchemy import event

from schemas.api.administration import Role
from service.access.principals import Principal
from service.app import assemble
from service.dispatch.job_events import JobEvents
from service.jobs.context import Service
from service.jobs.entry import enter
from service.jobs.submission import Prepared, Submission, prepare
from service.settings import Settings
from service.storage.database.connection import Database
from service.storage.database.migrations import upgrade
from tests.postgres_server import PostgresServer
from tests.service.between import Between
from tests.service.support import scene

MOST_TRIPS = 7


async def prepared(settings: Settings) -> tuple[Service, list[Prepared]]:
    """A service in which nothing runs, and two jobs that are to be entered."""
    service = assemble(settings, JobEvents())
    return service, [await read(service, number) for number in (1, 2)]


async def read(service: Service, number: int) -> Prepared:
    document = scene(64, 64)
    document["camera"]["position"][0] = number
    body = json.dumps({"scene": document, "labels": {"course": "x"}}).encode()
    found = await prepare(service, Submission(Principal("ann", Role.SUBMIT), body, key=str(number)))
    assert isinstance(found, Prepared)
    return found


def trips(trace: str) -> int:
    """Count how often what was sent is followed by an answer, in a trace of libpq."""
    sides = re.findall(r"^[\d:. -]+\t([FB])\t", trace, re.MULTILINE)
    return sum(pair == ("F", "B") for pair in pairwise(sides))


@pytest.mark.slow
def test_transaction_makes_few_round_trips(tmp_path: Path, postgres: PostgresServer) -> None:
    near = Database(postgres.database())
    upgrade(near)
    near.close()
    # Answers that come from afar are not read before all is sent that does not need them.
    between = Between(str(postgres.folder / ".s.PGSQL.5432"), far=True)
    far = near.engine.url.set(host="127.0.0.1", port=between.port, query={})
    settings = Settings(data=tmp_path, database=far.render_as_string(hide_password=False))
    service, (first, second) = asyncio.run(prepared(settings))
    files = (tmp_path / f"trace {number}" for number in count())
    with ExitStack() as stack:

        def trace(driver: Any, *_: object) -> None:
            driver.pgconn.trace(stack.enter_context(next(files).open("w")).fileno())

        enter(service, first)
        event.listen(service.database.engine, "checkout", trace)
        event.listen(service.database.engine, "checkin", lambda driver, _: driver.pgconn.untrace())
        enter(service, second)
        service.database.close()
        between.close()
    traces = [path.read_text() for path in tmp_path.glob("trace *")]
    [writing] = [trace for trace in traces if "COMMIT" in trace]
    assert 0 < trips(writing) <= MOST_TRIPS
