"""Calls of the asynchronous client for admins."""

from __future__ import annotations

from schemas.api.administration import Pruned, UserList, WorkerList
from service.client import calls, flows
from service.client.async_connection import AsyncConnection


class AsyncOperations(AsyncConnection):
    """Calls that need the key of an admin; without one they raise NotAllowedError."""

    async def workers(self) -> WorkerList:
        """The workers of the server that answers, with their tasks."""
        return await self._send(calls.ask("/v1/workers", WorkerList))

    async def users(self, *, cursor: str | None = None) -> UserList:
        """A page of users with their use; `cursor` is the ``next`` of the previous page."""
        params = {"limit": "1000"} | ({"cursor": cursor} if cursor else {})
        return await self._send(calls.ask("/v1/users", UserList, params))

    async def prune(
        self,
        *,
        keep_seconds: float | None = None,
        max_stored_bytes: int | None = None,
        keep_asset_seconds: float | None = None,
        dry_run: bool = True,
    ) -> Pruned:
        """List what the service would delete by these rules, or its own; ``dry_run=False`` deletes it.

        Raises
        ------
        NotAllowedError
            The key is not that of an admin.
        """
        rules = flows.given(
            keep_seconds=keep_seconds,
            max_stored_bytes=max_stored_bytes,
            keep_asset_seconds=keep_asset_seconds,
            dry_run=dry_run,
        )
        return await self._send(calls.post("/v1/prune", rules, Pruned))
