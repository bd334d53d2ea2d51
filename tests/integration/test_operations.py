"""What the operator of a service asks, and what its documents say."""

from __future__ import annotations

import sqlite3
from contextlib import closing
from importlib.metadata import version
from pathlib import Path

import httpx2
import jsonschema_rs
import pytest
from starlette.testclient import TestClient

from service.app import create_app
from service.settings import Settings
from tests.integration.conftest import Start
from tests.integration.support import PATIENCE, scene


def test_a_running_service_says_that_it_is_well(client: httpx2.Client) -> None:
    assert [client.get(path).json() for path in ("/livez", "/readyz")] == [{"status": "ok"}] * 2


def test_a_service_says_which_one_it_is(client: httpx2.Client) -> None:
    expected = {"name": "penumbra", "version": version("penumbra-render"), "api": "v1"}
    assert client.get("/version").json() == expected


def test_the_schema_of_scenes_takes_scenes_and_nothing_else(client: httpx2.Client) -> None:
    schema = jsonschema_rs.validator_for(client.get("/v1/schemas/scene.json").json())
    assert schema.is_valid(scene())
    assert not schema.is_valid(scene() | {"shapes": [{"type": "cube"}]})
    assert not schema.is_valid(scene() | {"unknown": 1})


def test_a_service_whose_disk_is_nearly_full_takes_no_jobs_and_lives(tmp_path: Path) -> None:
    # More than any disk has.
    app = create_app(Settings(data=tmp_path, workers=1, min_free_bytes=1 << 62))
    with TestClient(app) as client:
        answer = client.get("/readyz")
        assert (answer.status_code, client.get("/livez").status_code) == (503, 200)
    assert "the disk is nearly full" in answer.json()["detail"]


@pytest.mark.slow
def test_a_service_whose_database_takes_no_writes_is_not_ready(start: Start, tmp_path: Path) -> None:
    with httpx2.Client(base_url=start(workers=1).url, timeout=PATIENCE) as client:
        with closing(sqlite3.connect(tmp_path / "penumbra.sqlite")) as connection:
            connection.execute("PRAGMA busy_timeout = 10000")
            connection.execute("BEGIN IMMEDIATE")
            answer = client.get("/readyz")
            assert "the database cannot be written" in answer.json()["detail"]
            connection.rollback()
        assert client.get("/readyz").status_code == 200


def test_a_service_that_hands_out_no_work_any_more_asks_to_be_started_again(tmp_path: Path) -> None:
    app = create_app(Settings(data=tmp_path, workers=1))
    with TestClient(app) as client:
        assert client.get("/livez").status_code == 200
        app.state.service.dispatcher.stop()
        answer = client.get("/livez")
        assert answer.status_code == 503
        assert "Start the service again" in answer.json()["detail"]
        assert client.get("/readyz").status_code == 503
