"""The arrays that were fetched last."""

from __future__ import annotations

import threading
from collections import OrderedDict
from collections.abc import Callable
from typing import Any

from numpy.typing import NDArray


class Recent:
    """Keeps the arrays that were asked for last, so that each is fetched once and not for every tile.

    Parameters
    ----------
    most_bytes : int
        As many are kept at most; a larger array is not kept at all.
    """

    def __init__(self, most_bytes: int) -> None:
        self._most = most_bytes
        self._arrays: OrderedDict[str, NDArray[Any]] = OrderedDict()
        self._lock = threading.Lock()

    def get(self, name: str, fetch: Callable[[], NDArray[Any]]) -> NDArray[Any]:
        """Return the array of a name, fetched unless it is here. Nobody may write to it."""
        with self._lock:
            if name in self._arrays:
                self._arrays.move_to_end(name)
                return self._arrays[name]
        array = fetch()
        array.flags.writeable = False
        with self._lock:
            self._arrays[name] = array
            while sum(kept.nbytes for kept in self._arrays.values()) > self._most:
                self._arrays.popitem(last=False)
        return array
