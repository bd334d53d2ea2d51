"""Clients that hold as many connections as they can: probes are answered, and others find room."""

from __future__ import annotations

import socket
from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager
from pathlib import Path

import httpx2
import pytest

from schemas.api.administration import Role
from service.access import keys
from service.api.connections import MOST_PROBES
from service.server import RunningServer, running
from service.settings import Settings
from service.storage.database.connection import Database
from service.storage.database.migrations import upgrade
from tests.service.support import TIMEOUT, long_scene, scene, submit, until

MOST, MOST_OF_ADDRESS, MOST_STREAMS = 12, 4, 2
# Whatever one of them holds, one more takes its place: these are more than the server keeps.
MANY = MOST + MOST_PROBES + 10
ADDRESSES = [f"127.0.0.{number}" for number in range(1, 6)]
UNFINISHED = b"GET /version HTTP/1.1\r\nHost: 127.0.0.1\r\nX-Slow: "


def settings(data: Path, **changes: object) -> Settings:
    limits = {"max_connections": MOST, "max_address_connections": MOST_OF_ADDRESS, "workers": 1}
    return Settings(**limits | {"data": data, "port": 0, "log_level": "error"} | changes)


@pytest.fixture(scope="module")
def server(tmp_path_factory: pytest.TempPathFactory) -> Iterator[RunningServer]:
    with running(settings(tmp_path_factory.mktemp("crowded"))) as started:
        yield started


@contextmanager
def held(server: RunningServer, addresses: list[str]) -> Iterator[None]:
    """Hold connections from each of these addresses, on which a request has begun and does not end."""
    host, port = server.url.removeprefix("http://").split(":")
    with ExitStack() as stack:
        for address in addresses:
            for _ in range(MANY):
                connection = socket.create_connection((host, int(port)), TIMEOUT, (address, 0))
                stack.enter_context(connection).sendall(UNFINISHED)
        yield


def ask(server: RunningServer, path: str, address: str) -> httpx2.Response:
    transport = httpx2.HTTPTransport(local_address=address)
    with httpx2.Client(base_url=server.url, transport=transport, timeout=TIMEOUT) as client:
        return client.get(path)


def is_answered(server: RunningServer, address: str) -> Callable[[], bool]:
    return lambda: ask(server, "/version", address).status_code == 200


@pytest.mark.parametrize("addresses", [ADDRESSES[:1], ADDRESSES], ids=["one address", "many addresses"])
def test_probes_are_answered_whatever_connections_others_hold(
    server: RunningServer, addresses: list[str]
) -> None:
    with held(server, addresses):
        for path in ("/livez", "/readyz"):
            for address in (addresses[0], "127.0.0.9"):
                answer = ask(server, path, address)
                assert (answer.status_code, answer.json()) == (200, {"status": "ok"})
    until(is_answered(server, addresses[0]))


def test_one_address_leaves_room_for_others(server: RunningServer) -> None:
    with held(server, ADDRESSES[:1]):
        assert ask(server, "/version", "127.0.0.9").status_code == 200
        refused = ask(server, "/version", ADDRESSES[0])
        assert (refused.status_code, refused.json()["code"]) == (429, "busy")
        assert str(MOST_OF_ADDRESS) in refused.json()["detail"]
        assert (refused.headers["Retry-After"], refused.headers["Connection"]) == ("1", "close")
        assert refused.headers["X-Request-ID"]
    until(is_answered(server, ADDRESSES[0]))


def test_without_room_for_anybody_the_answer_says_so(server: RunningServer) -> None:
    with held(server, ADDRESSES):
        refused = ask(server, "/version", "127.0.0.9")
        assert (refused.status_code, refused.json()["code"]) == (503, "unavailable")
        assert refused.headers["Retry-After"] == "1"
    until(is_answered(server, "127.0.0.9"))


def test_all_that_a_proxy_passes_on_may_have_one_address(tmp_path: Path) -> None:
    with running(settings(tmp_path, trusted_proxies="127.0.0.1")) as server, ExitStack() as stack:
        clients = [
            stack.enter_context(httpx2.Client(base_url=server.url, timeout=TIMEOUT)) for _ in range(MOST - 1)
        ]
        # Each keeps its connection.
        assert [client.get("/version").status_code for client in clients] == [200] * len(clients)


@pytest.fixture(scope="module")
def users(tmp_path_factory: pytest.TempPathFactory) -> Iterator[dict[str, httpx2.Client]]:
    """Two users of a service that requires keys."""
    wanted = settings(
        tmp_path_factory.mktemp("users"), max_address_connections=MOST, max_user_streams=MOST_STREAMS
    )
    database = Database(wanted.database_url)
    upgrade(database)
    with database.writing() as session:
        made = {name: str(keys.add(session, name, Role.SUBMIT)) for name in ("ann", "bob")}
    database.close()
    with running(wanted) as server, ExitStack() as stack:
        yield {
            name: stack.enter_context(
                httpx2.Client(
                    base_url=server.url, timeout=TIMEOUT, headers={"Authorization": f"Bearer {key}"}
                )
            )
            for name, key in made.items()
        }


def paused(client: httpx2.Client) -> str:
    """A job that does not end."""
    job = submit(client, long_scene())
    client.post(f"/v1/jobs/{job}/pause").raise_for_status()
    return job


@contextmanager
def watched(client: httpx2.Client, job: str) -> Iterator[int]:
    with client.stream("GET", f"/v1/jobs/{job}/events") as answer:
        yield answer.status_code


def test_streams_of_one_user_leave_room_for_others(users: dict[str, httpx2.Client]) -> None:
    ann, bob = users["ann"], users["bob"]
    jobs = {name: paused(client) for name, client in users.items()}
    with ExitStack() as stack:
        for _ in range(MOST_STREAMS):
            assert stack.enter_context(watched(ann, jobs["ann"])) == 200
        tiles = f"/v1/jobs/{jobs['ann']}/tiles?after=1000"
        for path in (f"/v1/jobs/{jobs['ann']}/events", f"{tiles}&wait=30"):
            refused = ann.get(path)
            assert (refused.status_code, refused.json()["code"]) == (429, "busy"), path
        # What does not wait is answered, and a job is accepted without the wait that it prefers.
        assert ann.get(tiles).status_code == 200
        taken = ann.post("/v1/jobs", json={"scene": scene(33, 31)}, headers={"Prefer": "wait=30"})
        assert (taken.status_code, taken.headers.get("Preference-Applied")) == (202, None)
        with watched(bob, jobs["bob"]) as status:
            assert status == 200

    def has_room() -> bool:
        with watched(ann, jobs["ann"]) as status:
            return status == 200

    until(has_room)


@pytest.mark.slow
def test_users_of_a_service_without_authentication_are_not_counted(tmp_path: Path) -> None:
    with (
        running(settings(tmp_path, max_address_connections=MOST, max_user_streams=1)) as server,
        httpx2.Client(base_url=server.url, timeout=TIMEOUT) as client,
        ExitStack() as stack,
    ):
        job = paused(client)
        assert [stack.enter_context(watched(client, job)) for _ in range(3)] == [200] * 3
