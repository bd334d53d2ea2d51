"""Reading tile events that the server pushes."""

from __future__ import annotations

import httpx2
from pydantic import ValidationError

from schemas.jobs import TileEvent
from service.client.errors import UnexpectedAnswerError


def tile_event(event: httpx2.ServerSentEvent) -> TileEvent | None:
    """The tile event in an event of the stream; None for an event of another kind."""
    if event.event != "tile":
        return None
    try:
        return TileEvent.model_validate_json(event.data)
    except ValidationError as error:
        raise UnexpectedAnswerError("The server sent an event that is not a tile.") from error
