"""The dispatcher, and a database whose answers get lost."""

import threading
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from sqlalchemy import event
from sqlalchemy.exc import OperationalError
from sqlalchemy.orm import Session

from service.settings import Settings
from tests.service.in_process import in_process
from tests.service.support import finish, scene, submit


@contextmanager
def lost(answers: int) -> Iterator[list[int]]:
    """So many commits of the dispatcher succeed, and it never hears of them."""
    left = [answers]

    def lose(_session: Session) -> None:
        if threading.current_thread().name == "dispatcher" and left[0]:
            left[0] -= 1
            raise OperationalError("COMMIT", None, ConnectionResetError())

    event.listen(Session, "after_commit", lose)
    try:
        yield left
    finally:
        event.remove(Session, "after_commit", lose)


def test_claims_whose_commit_was_not_answered_are_taken_back(tmp_path: Path) -> None:
    with in_process(Settings(data=tmp_path, workers=1)) as local, local.client() as client:
        with lost(2) as left:
            finish(client, submit(client, scene(32, 24)))
            assert left == [0]
        lines = dict(line.rsplit(" ", 1) for line in client.get("/metrics").text.splitlines())
        assert float(lines['penumbra_retries_total{cause="database_lost"}']) > 0
