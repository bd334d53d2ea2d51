"""What routes work with."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated

from fastapi import Depends, Request

from service.access.known import Known
from service.database.connection import Database
from service.dispatcher import Dispatcher
from service.feed import Feed
from service.keeper import Keeper
from service.prices import QuotedPrices
from service.seats import Seats
from service.settings import Settings
from service.store.assets import AssetStore
from service.store.passes import PassStore
from service.store.tiles import TileStore


@dataclass(frozen=True)
class Service:
    """The parts of a running service."""

    settings: Settings
    database: Database
    store: TileStore
    passes: PassStore
    assets: AssetStore
    dispatcher: Dispatcher
    keeper: Keeper
    feed: Feed
    quote_seats: Seats
    comparison_seats: Seats
    prices: QuotedPrices
    known: Known


def _service(request: Request) -> Service:
    service = request.app.state.service
    assert isinstance(service, Service)
    return service


Here = Annotated[Service, Depends(_service)]
