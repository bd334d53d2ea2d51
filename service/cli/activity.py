"""``penumbra doctor --server``: tasks of the workers of a running service, and use by each user."""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING

from service.cli import output
from service.cli.options import connect

if TYPE_CHECKING:
    from schemas.api.administration import UserUse, WorkerInfo
    from service.client import Client

WORKERS = ("worker", "pid", "memory", "task", "for", "user", "job")
USERS = ("user", "open jobs", "stored", "CPU seconds", "last used")
MIB = 1 << 20


def show_activity(server: str, *, as_json: bool) -> None:
    """Print the workers of the server that answers, and all users."""
    with connect(server) as client:
        found, users = client.workers(), list(_users(client))
    if as_json:
        document = found.model_dump(mode="json")
        output.document(document | {"users": [user.model_dump(mode="json") for user in users]})
        return
    output.say(f"The service at {server} answers as {output.harmless(found.server)}.")
    for headings, rows in ((WORKERS, map(_worker, found.workers)), (USERS, map(_user, users))):
        if output.on_terminal():
            output.show(output.table(headings, rows))
        else:
            output.report({}, map("\t".join, rows), as_json=False)


def _users(client: Client) -> Iterator[UserUse]:
    page = client.users()
    yield from page.users
    while page.next is not None:
        page = client.users(cursor=page.next)
        yield from page.users


def _worker(worker: WorkerInfo) -> tuple[str, ...]:
    memory = "" if worker.memory_bytes is None else f"{worker.memory_bytes / MIB:.0f} MiB"
    task = (worker.task, f"{worker.seconds:.1f} s") if worker.task else ("idle", "")
    users = output.harmless(", ".join(worker.users))
    return worker.name, str(worker.pid or ""), memory, *task, users, ", ".join(worker.jobs)


def _user(user: UserUse) -> tuple[str, ...]:
    used = f"{user.last_used_at:%Y-%m-%d %H:%M} UTC" if user.last_used_at else ""
    stored = f"{user.stored_bytes / MIB:.1f} MiB"
    return output.harmless(user.user), str(user.open_jobs), stored, f"{user.cpu_seconds:.1f}", used
