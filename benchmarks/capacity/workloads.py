"""Who sends what when, and how long it takes to render."""

from __future__ import annotations

import json
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

import scenes

if TYPE_CHECKING:
    from numpy.typing import NDArray

BASIC = Path(str(scenes.__file__)).parent / "gallery" / "basic.json"
SIDE = 64
SPREAD = 0.5
"""Standard deviation of the logarithm of the seconds that a tile takes, about those expected."""


@dataclass(frozen=True)
class Workload:
    """Jobs of many users, and the slots that render them.

    Attributes
    ----------
    cpu_seconds : float
        Of a job, in the mean.
    load : float
        What arrives in a second, in CPU seconds, over what the slots render in it; infinite if all jobs
        arrive at once.
    even : bool
        Whether all users send as much; else the k-th sends in proportion to 1 / k.
    """

    users: int
    jobs: int
    slots: int
    cpu_seconds: float
    load: float
    even: bool = False
    seed: int = 0

    @property
    def rate(self) -> float:
        """Jobs that arrive in a second."""
        return self.load * self.slots / self.cpu_seconds

    def arrivals(self) -> NDArray[np.float64]:
        """Draw the times of arrival, seconds, (jobs,), those of a Poisson process."""
        return np.cumsum(self._random(0).exponential(1.0 / self.rate, self.jobs))

    def senders(self) -> NDArray[np.int64]:
        """Draw the numbers of the users who send them, (jobs,), 0 for the one who sends most."""
        if self.even:
            return self._random(1).permutation(np.arange(self.jobs) % self.users)
        shares = 1.0 / np.arange(1, self.users + 1)
        return self._random(1).choice(self.users, self.jobs, p=shares / shares.sum())

    def factors(self) -> NDArray[np.float64]:
        """Draw what tiles take over what is expected of them, (1024,), 1 in the mean."""
        return np.exp(self._random(2).normal(-0.5 * SPREAD**2, SPREAD, 1024))

    def _random(self, stream: int) -> np.random.Generator:
        return np.random.default_rng((self.seed, stream))


def request() -> bytes:
    """Write the job that all users send: a small picture, as graders do."""
    document: dict[str, Any] = json.loads(BASIC.read_text())
    document["camera"] |= {"width": SIDE, "height": SIDE}
    return json.dumps({"scene": document}).encode()
