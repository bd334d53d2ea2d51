"""Plans that a worker keeps for the next tiles of its jobs, and the memory that they may take."""

from __future__ import annotations

import gc
import resource
from collections import OrderedDict
from collections.abc import Callable
from contextlib import suppress
from pathlib import Path

from renderer import RenderPlan
from renderer.accelerators.trees import forget_trees

# The jobs whose tiles a worker usually gets in turns.
MAX_PLANS = 4
# Share of the memory for earlier jobs: a new one may need any amount.
KEPT_SHARE = 0.5


class KeptPlans:
    """The plans of the last few jobs.

    Parameters
    ----------
    memory_bytes : int
        Address space of this process.
    """

    def __init__(self, memory_bytes: int) -> None:
        self._memory_bytes = memory_bytes
        self._plans: OrderedDict[str, RenderPlan] = OrderedDict()

    def get(self, name: str, compiled: Callable[[], RenderPlan]) -> RenderPlan:
        """Return the plan of this name, compiled unless it is kept."""
        if name not in self._plans:
            self._make_room()
            self._plans[name] = compiled()
        self._plans.move_to_end(name)
        return self._plans[name]

    def drop(self) -> bool:
        """Keep no plan any more; False if there was none."""
        kept = bool(self._plans)
        self._plans.clear()
        _collect()
        return kept

    def _make_room(self) -> None:
        while len(self._plans) >= MAX_PLANS:
            self._plans.popitem(last=False)
        # Collecting takes longer than the smallest job, and helps only if memory is short.
        while self._plans and address_space() > KEPT_SHARE * self._memory_bytes:
            self._plans.popitem(last=False)
            _collect()


def _collect() -> None:
    """Give back the memory of plans that are not kept any more."""
    forget_trees()
    gc.collect()


def address_space() -> int:
    """Return the bytes of this process's address space; 0 where the system does not tell."""
    with suppress(OSError):
        pages = Path("/proc/self/statm").read_text(encoding="ascii").split()[0]
        return int(pages) * resource.getpagesize()
    return 0
