"""Reading tile events that the server pushes."""

from __future__ import annotations

from collections.abc import Iterator

import httpx2
from pydantic import ValidationError

from schemas.jobs import TileEvent
from service.client.errors import UnexpectedAnswerError


def read_events(answer: httpx2.Response) -> Iterator[TileEvent]:
    """The tile events of a stream; events of other kinds are passed over."""
    for event in httpx2.EventSource(answer):
        if event.event == "tile":
            try:
                yield TileEvent.model_validate_json(event.data)
            except ValidationError as error:
                raise UnexpectedAnswerError(f"{answer.url} sent an event that is not a tile.") from error
