"""Jobs are found again by labels and states, page by page."""

from __future__ import annotations

import asyncio
from pathlib import Path

import pytest

from service.client import AsyncClient, Client
from tests.acceptance.conftest import Penumbra, Server

pytestmark = pytest.mark.slow


def test_jobs_are_submitted_with_labels_and_listed_by_them(
    penumbra: Penumbra, server: Server, scene_file: Path
) -> None:
    mine = ["--label", "course:cs171", "--label", "due:12:30"]
    first = penumbra("submit", scene_file, *mine, "--wait").out.strip()
    other = penumbra("submit", scene_file, "--label", "course:other").out.strip()
    second = penumbra("submit", scene_file, *mine, "--wait").out.strip()
    listed = penumbra("ls", *mine, "--json").document
    assert [job["id"] for job in listed["jobs"]] == [second, first]
    assert listed["jobs"][0]["labels"] == {"course": "cs171", "due": "12:30"}
    assert other in penumbra("ls").out
    assert penumbra("ls", "--state", "failed", *mine).out == ""

    page = penumbra("ls", *mine, "--limit", 1)
    assert page.out.startswith(second)
    after = page.err.strip().rpartition(" ")[2]
    rest = penumbra("ls", *mine, "--after", after)
    assert (rest.out.split("\t")[0], rest.err) == (first, "")

    async def found() -> list[str]:
        async with AsyncClient(server.url) as client:
            return [job.id async for job in client.jobs(state="succeeded", labels={"course": "cs171"})]

    assert asyncio.run(found()) == [second, first]


def test_a_long_list_is_put_together_from_pages(server: Server, penumbra: Penumbra, scene_file: Path) -> None:
    with Client(server.url) as client:
        job = client.submit(scene_file, labels={"batch": "long"}).wait()
        ids = [client.submit(scene_file, labels={"batch": "long"}).id for _ in range(104)]
        expected = [*ids[::-1], job.id]
        assert [found.id for found in client.jobs(labels={"batch": "long"})] == expected
    listed = penumbra("ls", "--label", "batch:long", "--limit", 104, "--json").document
    assert [found["id"] for found in listed["jobs"]] == expected[:104]
    assert listed["next"] is not None


def test_a_label_needs_a_name(penumbra: Penumbra) -> None:
    outcome = penumbra("ls", "--label", "cs171")
    assert outcome.code == 2
    assert "course:cs171" in outcome.err
