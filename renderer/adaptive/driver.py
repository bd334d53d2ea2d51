"""Driver of a picture of target quality: the tiles and requests of each pass, and the decision after it.

It runs nothing itself. `adaptive_render` sends its requests to processes of this machine, the service to its
workers through a database; a picture has the same passes, tiles and bytes either way.
"""

from dataclasses import dataclass, field
from functools import partial
from typing import Self

from renderer.adaptive.controller import advance
from renderer.adaptive.error_statistics import settle
from renderer.adaptive.estimate import Estimate
from renderer.adaptive.forecast import MERGING, Forecast, Prices, forecast, kind_of, measured, usual_prices
from renderer.adaptive.guides import surroundings
from renderer.adaptive.partition import pass_tiles
from renderer.adaptive.requests import Samples, TileRequest
from renderer.adaptive.target_plan import target_plan
from renderer.adaptive.time_limits import NO_LIMIT, TimeLimit
from renderer.plan.plan import RenderPlan
from schemas.tiles import Tile


@dataclass(slots=True)
class Driver:
    """State of a picture during a pass or between two.

    Attributes
    ----------
    estimate : Estimate
    prices : dict
        CPU seconds of a ray by kind, and of merging a pass.
    workers : int
        Processes that share the tiles of a pass; 0 if no one waits for single tiles.
    tile_size : int or None
        Side of the tiles, pixels; None for tiles of about equal work.
    """

    estimate: Estimate
    prices: Prices
    workers: int
    tile_size: int | None
    _work: float = field(default=0.0, init=False)
    _seconds: float = field(default=0.0, init=False)
    _tiles: int = field(default=0, init=False)

    @classmethod
    def begin(cls, plan: RenderPlan, workers: int = 0, tile_size: int | None = None) -> Self:
        """Begin a picture."""
        return cls(Estimate.begin(target_plan(plan)), usual_prices(plan), workers, tile_size)

    @property
    def is_first(self) -> bool:
        """Whether the next pass is the first."""
        return not self.estimate.have.any()

    @property
    def ray_seconds(self) -> float:
        """Expected CPU seconds of a ray of the next pass."""
        return self.prices[kind_of(self.estimate)]

    def forecast(self, merging: float = 0.0) -> Forecast:
        """Predicted CPU seconds of the rest, where merging the last pass has taken `merging`, if any."""
        if merging:
            self.prices = {**self.prices, MERGING: merging}
        return forecast(self.estimate, self.prices)

    def tiles(self) -> list[Tile]:
        """Tiles of the next pass."""
        records = self.is_first and self.estimate.plan.records_centres
        return pass_tiles(self.estimate, self.prices, self.workers, self.tile_size, records=records)

    def requests(self, limit: TimeLimit = NO_LIMIT) -> list[TileRequest]:
        """Requests of the next pass, each to be finished at the limit; the first is finished in any case."""
        first, requested = self.is_first, self.estimate.requested
        plan, around, limit = self.estimate.plan, self.estimate.around, NO_LIMIT if first else limit

        def request(tile: Tile) -> TileRequest:
            levels, nearby = requested.part(tile), partial(surroundings, tile, around)
            return TileRequest.of(plan, tile, levels, nearby, limit, first=first)

        return [request(tile) for tile in self.tiles()]

    def take(self, tile: Tile, samples: Samples) -> None:
        """Merge the samples of a tile. The order of tiles does not matter."""
        self._work = self._work or self.estimate.work_wanted()
        self._seconds += samples.cpu_seconds
        self._tiles += 1
        self.estimate.take(tile, samples)

    def end_pass(self, *, last: bool) -> bool:
        """Decide about the next pass that has any work; False if the picture is done.

        Parameters
        ----------
        last : bool
            Whether time is up, so that no pass follows; tiles may be missing then.
        """
        if last:
            settle(self.estimate)
            return False
        if self._tiles:
            kind = kind_of(self.estimate)
            self.prices = measured(self.prices, kind, self._seconds, self._work, self._tiles)
        self._work, self._seconds, self._tiles = 0.0, 0.0, 0
        while advance(self.estimate):
            if self.estimate.rays_wanted():
                return True
        return False
