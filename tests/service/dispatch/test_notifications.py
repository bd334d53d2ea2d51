"""Notifications between servers, over a connection that is lost in silence."""

import time
from contextlib import closing
from pathlib import Path

import pytest
from sqlalchemy.engine import make_url

from tests.postgres_server import PostgresServer
from tests.service.between import Between
from tests.service.failover import leads, pair
from tests.service.sending import client_of
from tests.service.support import scene

WAIT_SECONDS, SOON_SECONDS = 50, 20


@pytest.mark.slow
@pytest.mark.parametrize("pools", [False, True], ids=["lost", "pooled"])
def test_silent_loss_is_noticed_by_those_who_wait(
    postgres: PostgresServer, tmp_path: Path, pools: bool
) -> None:
    url = postgres.database()
    with closing(Between(str(postgres.folder / ".s.PGSQL.5432"), pools=pools)) as between:
        through = f"postgresql+psycopg://postgres@127.0.0.1:{between.port}/{make_url(url).database}"
        with pair(tmp_path, through, first_url=url) as two, client_of(two.second) as client:
            assert leads(two.first)
            if not pools:
                between.deafen()
            headers = {"Prefer": f"wait={WAIT_SECONDS}"}
            for width in (24, 25):
                begun = time.monotonic()
                job = client.post("/v1/jobs", json={"scene": scene(width, 24)}, headers=headers).json()
                assert (job["state"], time.monotonic() - begun < SOON_SECONDS) == ("succeeded", True)
