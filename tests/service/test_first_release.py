"""Jobs of version 0.1.0 after an upgrade: they run to their end, and every address of each answers."""

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import httpx2
import pytest
from sqlalchemy import create_engine, select, text

from schemas.api.jobs import Job
from service.storage.database.migrations.versions.tables_0001 import METADATA
from tests.service.first_release import ENDED, FILE, OPEN, copied, listed, serving, unpack
from tests.service.support import KINDS, until

pytestmark = [pytest.mark.slow, pytest.mark.parametrize("release", KINDS, indirect=True)]

UNCOUNTED = ("fixed", "handed_out")
"""Jobs whose renders have none of what was counted in later tables, as those tables allow."""
JOBS = METADATA.tables["jobs"]
READ = ("", "tiles", "plan", "log", "convergence", "request", "image.npy", "image.png", "image.exr")


class Release:
    """A data folder of version 0.1.0, and its database."""

    def __init__(self, data: Path, url: str) -> None:
        self.data, self.url = data, url

    def change(self, name: str, table: str, column: str, value: Any) -> None:
        """Put another value into the row of a job, or into that of its render."""
        key = ("id", "id") if table == "jobs" else ("number", "render_number")
        row = f"{key[0]} = (SELECT {key[1]} FROM jobs WHERE id = :job)"  # noqa: S608  (names of tables)
        engine = create_engine(self.url)
        with engine.begin() as connection:
            labels: Any = connection.execute(select(JOBS.c.id, JOBS.c.labels))
            [job] = [job for job, found in labels if found["name"] == name]
            statement = text(f"UPDATE {table} SET {column} = :value WHERE {row}")  # noqa: S608
            connection.execute(statement, {"value": value, "job": job})
        engine.dispose()


@pytest.fixture
def release(request: pytest.FixtureRequest, tmp_path: Path) -> Release:
    data = unpack(tmp_path)
    if request.param == "sqlite":
        return Release(data, f"sqlite:///{data / FILE}")
    url = request.getfixturevalue("postgres").database()
    copied(data, url)
    return Release(data, url)


def finished(client: httpx2.Client) -> dict[str, dict[str, Any]]:
    """Resume what was paused, wait until all has ended, and return it."""
    for job in listed(client).values():
        if job["paused"]:
            client.post(f"/v1/jobs/{job['id']}/resume").raise_for_status()
    until(lambda: not any(job["state"] in {"queued", "running"} for job in listed(client).values()), 120)
    return listed(client)


def test_jobs_run_to_their_end_and_are_read(release: Release) -> None:
    for name in UNCOUNTED:
        release.change(name, "renders", "numerics", "{}")
        release.change(name, "renders", "pass_costs", "[]")
    with serving(release.data, release.url) as client:
        jobs = finished(client)
        states = {name: job["state"] for name, job in jobs.items()}
        assert states == ENDED | dict.fromkeys(OPEN, "succeeded")
        assert [job["damage"] for job in jobs.values() if job["damage"]] == []
        for name, job in jobs.items():
            # A missing count is not 0.
            counted = job["state"] in {"succeeded", "expired"} and name not in UNCOUNTED
            assert (job["numerics"] is not None) == counted
            for address in addresses(job):
                answer = client.get(address)
                gone = "/image." in address and job["state"] != "succeeded"
                assert answer.status_code == (410 if gone else 200), (name, answer.text)
            batch = client.get(job["links"]["tiles"], headers={"Accept": "application/octet-stream"})
            assert batch.status_code == 200


def addresses(job: dict[str, Any]) -> Iterator[str]:
    yield from (f"/v1/jobs/{job['id']}/{name}".rstrip("/") for name in READ)
    yield from job["links"]["layers"].values()


NUMERICS = '{"non_finite": -1, "clamped": 0, "degenerate_dropped": 0, "retried": 0}'
DAMAGES = {
    "expired": ("jobs", "parting", "{}"),
    "fixed": ("renders", "numerics", NUMERICS),
    "random": ("renders", "pass_costs", "[{}]"),
    "layers": ("jobs", "warnings", "[1]"),
    "cancelled": ("jobs", "quality", "[]"),
    "failed": ("jobs", "failure", '{"code": 1}'),
    "target": ("renders", "layers", "7"),
}
UNFIT = {
    "queued": ("renders", "passes", "[]"),
    "merged": ("renders", "merges", "[{}, {}]"),
    "handed_out": ("renders", "pass_costs", "[1, 2, 3, 4]"),
}
"""Damage that stops a job: it is found when a tile is handed out, merged, and recorded."""
NO_JSON = {"fixed": ("renders", "numerics", "{"), "random": ("jobs", "created_at", "yesterday")}
"""PostgreSQL stores no such values."""


def test_damaged_job_fails_while_the_others_continue(release: Release) -> None:
    damages = DAMAGES | UNFIT | (NO_JSON if release.url.startswith("sqlite") else {})
    for name, damage in damages.items():
        release.change(name, *damage)
    with serving(release.data, release.url) as client:
        jobs = listed(client)
        assert list(jobs) == [*reversed(OPEN), *reversed(ENDED)]
        for name in DAMAGES:
            check_shown(client, jobs[name], ENDED[name])
        ended = finished(client)
        assert {name for name in ENDED if ended[name]["damage"]} == set(DAMAGES)
        states = {name: ended[name]["state"] for name in OPEN}
        assert states == dict.fromkeys(OPEN, "succeeded") | dict.fromkeys(UNFIT, "failed")
        assert client.get("/readyz").status_code == 200
        pruned = client.post("/v1/prune", json={"max_stored_bytes": 0, "dry_run": False}).raise_for_status()
        assert pruned.json()["expired"]
        # What can be read goes, and what cannot is still shown.
        kept = {name: job["state"] for name, job in listed(client).items()}
        assert kept | dict.fromkeys(set(OPEN) - set(UNFIT), "expired") == kept


def check_shown(client: httpx2.Client, job: dict[str, Any], state: str) -> None:
    Job.model_validate(job)
    assert job["state"] == state
    assert job["damage"]
    assert client.get(job["links"]["self"]).json() == job
    tiles = client.get(job["links"]["tiles"])
    assert tiles.status_code == 200 or tiles.json()["code"] == "job_damaged"
