"""Warning filters belong to the process: threads that change them do so one after another."""

import threading
import warnings
from collections.abc import Iterator
from contextlib import contextmanager

# Reentrant: a reader of meshes may decode the pictures that they name.
_lock = threading.RLock()


@contextmanager
def changed_filters() -> Iterator[None]:
    """Give back the filters of before at the end, as `warnings.catch_warnings` does for one thread alone.

    Two threads inside of that one at a time would give back each other's filters, for good.
    """
    with _lock, warnings.catch_warnings():
        yield
