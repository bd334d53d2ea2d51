"""Scenes small enough to render at once, and access to the processes of a server."""

import io
import os
import signal
import sqlite3
import time
from collections.abc import Callable
from contextlib import closing
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

import httpx2
import numpy as np
import pytest
from sqlalchemy.orm import Session

from schemas.api.jobs import JobState
from service.lifecycle import fairness
from service.storage.database.models import JobRow, RenderRow

TIMEOUT = 60.0
HANDED_SECONDS = 0.5
STEPS = "SELECT * FROM tiles WHERE render IN (SELECT render_number FROM jobs WHERE id LIKE ?)"

KINDS = ["sqlite", "postgresql"]
BOTH = pytest.mark.parametrize("database", KINDS, indirect=True)
"""Once with each kind of database."""
SERVED = ["sqlite", pytest.param("postgresql", marks=pytest.mark.slow)]
"""Kinds below a whole service: tests of the database alone try both in the fast tier."""
ON_BOTH = pytest.mark.parametrize("client", SERVED, indirect=True)
"""Once with a server on each kind of database."""
API_ON_BOTH = pytest.mark.parametrize("api", SERVED, indirect=True)
"""Once with a service in this process on each kind of database."""


def scene(
    width: int = 80,
    height: int = 48,
    *,
    samples: int = 4,
    light_samples: int = 4,
    pattern: str = "uniform",
    light_pattern: str = "uniform",
) -> dict[str, Any]:
    """A ball over a floor under a square light: highlights, a penumbra, edges."""
    return {
        "version": 1,
        "name": "ball",
        "camera": {
            "position": [0, 2, 6],
            "look_at": [0, 0.5, 0],
            "vertical_fov": 40,
            "width": width,
            "height": height,
        },
        "background": [0.1, 0.2, 0.3],
        "ambient": [1, 1, 1],
        "materials": {
            "floor": {"type": "phong", "color": [0.7, 0.7, 0.7], "ambient": 0.1, "diffuse": 1.0},
            "ball": {
                "type": "phong",
                "color": [0.7, 0.2, 0.1],
                "ambient": 0.1,
                "diffuse": 0.8,
                "specular": 0.3,
                "shininess": 20,
            },
        },
        "shapes": [
            {
                "type": "rectangle",
                "center": [0, 0, 0],
                "normal": [0, 1, 0],
                "tangent": [1, 0, 0],
                "size": [8, 8],
                "material": "floor",
            },
            {"type": "ellipsoid", "center": [0, 1, 0], "radius": 1, "material": "ball"},
        ],
        "lights": [
            {
                "type": "rectangle",
                "center": [2, 4, 2],
                "normal": [-0.5, -1, -0.5],
                "tangent": [1, 0, -1],
                "size": [1, 1],
                "color": [0.9, 0.9, 0.9],
            }
        ],
        "sampling": {
            "antialiasing": {"pattern": pattern, "samples": samples},
            "light": {"pattern": light_pattern, "samples": light_samples},
            "seed": 7,
        },
    }


def work() -> dict[str, Any]:
    """About a second of work in dozens of steps: there is time to disturb it."""
    return scene(192, 192, samples=16, light_samples=36)


def enter(session: Session, job_id: str, render: RenderRow, **fields: Any) -> JobRow:
    """Enter a job that has just been submitted."""
    job = job_with(job_id, render, **fields)
    session.add(job)
    session.flush()
    fairness.activate(session, [job.owner])
    return job


def job_with(job_id: str, render: RenderRow, *, owner: str = "local", **fields: Any) -> JobRow:
    """A job of a render, not entered yet."""
    return JobRow(
        id=job_id,
        owner=owner,
        render=render,
        quality={"mode": "fixed"},
        plan={},
        warnings=[],
        predicted_cpu_seconds=render.predicted_cpu_seconds,
        coarse_cpu_seconds=fairness.coarse_cpu_seconds(render),
        created_at=datetime.now(UTC),
        **fields,
    )


def pictured(render: str, **more: Any) -> RenderRow:
    """A finished render of one pixel."""
    return RenderRow(
        id=render,
        state=JobState.SUCCEEDED,
        width=1,
        height=1,
        spec_sha256="",
        passes=[{"index": 0, "stride": 1, "first": 0, "last": 1}],
        display={},
        total_steps=0,
        total_work=1,
        predicted_cpu_seconds=1.0,
        numerics={},
        pass_costs=[],
        **more,
    )


def long_scene() -> dict[str, Any]:
    """Some seconds of work in dozens of steps: there is time to disturb it."""
    return scene(256, 256, samples=36, light_samples=64)


def submit(client: httpx2.Client, document: dict[str, Any], **request: Any) -> str:
    # These tests need a render, not a stored result.
    headers = {"Cache-Control": "no-cache"}
    answer = client.post("/v1/jobs", json={"scene": document, **request}, headers=headers)
    assert answer.status_code == 202, answer.text
    return answer.json()["id"]


def job_of(client: httpx2.Client, job: str) -> dict[str, Any]:
    return client.get(f"/v1/jobs/{job}").json()


def wait(client: httpx2.Client, job: str, done: Callable[[dict[str, Any]], bool]) -> dict[str, Any]:
    """Follow a job by long-polling until it is as wanted."""
    after, deadline = 0, time.monotonic() + TIMEOUT
    while time.monotonic() < deadline:
        found = job_of(client, job)
        if done(found):
            return found
        assert not (ended(found)), found
        after = client.get(f"/v1/jobs/{job}/tiles", params={"after": after, "wait": 5}).json()["next"]
    raise AssertionError("the job did not get there in time")


def ended(job: dict[str, Any]) -> bool:
    return job["state"] in {"succeeded", "failed", "cancelled"}


def finish(client: httpx2.Client, job: str) -> dict[str, Any]:
    """Wait until a job has succeeded."""
    found = wait(client, job, ended)
    assert found["state"] == "succeeded", found
    return found


def image(client: httpx2.Client, job: str) -> np.ndarray:
    answer = client.get(f"/v1/jobs/{job}/image.npy")
    assert answer.status_code == 200, answer.text
    return np.load(io.BytesIO(answer.content))


def steps(data: Path, job: str = "%") -> dict[tuple[int, int], dict[str, Any]]:
    """Rows of all steps of a job, or of the only one in a data folder."""
    with closing(sqlite3.connect(data / "penumbra.sqlite")) as connection:
        connection.row_factory = sqlite3.Row
        rows = connection.execute(STEPS, (job,)).fetchall()
    return {(row["pass_index"], row["tile"]): dict(row) for row in rows}


def kill_at_work(worker: int) -> None:
    """Kill a worker while it has a tile: one that is stopped between two is handed the next."""
    os.kill(worker, signal.SIGSTOP)
    time.sleep(HANDED_SECONDS)
    os.kill(worker, signal.SIGKILL)


def until(condition: Callable[[], bool], seconds: float = 30.0) -> None:
    """Wait for something that no request can wait for."""
    deadline = time.monotonic() + seconds
    while not condition():
        assert time.monotonic() < deadline, "it did not happen in time"
        time.sleep(0.02)
