"""Prices that pilots have found, for the jobs that are submitted next."""

from __future__ import annotations

import hashlib
import threading
from collections import OrderedDict

from schemas.jobs import JobRequest

KEPT = 1024


class QuotedPrices:
    """Remembers what the last quotes said, by scene and quality. Used by many threads."""

    def __init__(self) -> None:
        self._lock = threading.Lock()
        self._known: OrderedDict[bytes, float] = OrderedDict()

    def learn(self, request: JobRequest, cpu_seconds: float) -> None:
        """Keep a price; the oldest is forgotten."""
        with self._lock:
            self._known[_name(request)] = cpu_seconds
            while len(self._known) > KEPT:
                self._known.popitem(last=False)

    def get(self, request: JobRequest) -> float | None:
        """CPU seconds of the same scene at the same quality, if that was quoted."""
        with self._lock:
            return self._known.get(_name(request))


def _name(request: JobRequest) -> bytes:
    """Digest of all that a price depends on; what layers cost is little."""
    content = request.model_dump_json(include={"scene", "quality"}, exclude_unset=True)
    return hashlib.sha256(content.encode()).digest()
