"""The predicted cost of a request, its limit, and prices measured by pilots."""

from __future__ import annotations

import hashlib
import threading
from collections import OrderedDict

import renderer
from schemas.api.jobs import JobRequest
from schemas.api.plans import PlanDocument
from schemas.errors import Problem
from schemas.quality import TargetQuality
from service.settings import Settings


def target_of(request: JobRequest) -> TargetQuality | None:
    """Return the target error of a request, if it has one."""
    return request.quality if isinstance(request.quality, TargetQuality) else None


def check_cost(description: PlanDocument, target: TargetQuality | None, settings: Settings) -> None:
    """Refuse a request whose predicted cost is above the limit.

    Raises
    ------
    renderer.SceneError
        It suggests what to reduce.
    """
    predicted, limit = description.cost.cpu_seconds, settings.max_cpu_seconds
    if predicted <= limit:
        return
    place, advice = ("/scene", "Ask for fewer pixels, samples or light samples.")
    if target is not None:
        place, advice = ("/quality/error", "Ask for fewer pixels or a larger error, or set a time_limit.")
    detail = (
        f"This is predicted to take {predicted:.0f} CPU seconds, more than the {limit:.0f} allowed. {advice}"
    )
    raise renderer.SceneError([Problem(pointer=place, detail=detail, code="cost")])


KEPT_PRICES = 1024


class QuotedPrices:
    """Caches the prices of the last quotes, by scene and quality. Used by many threads."""

    def __init__(self) -> None:
        self._lock = threading.Lock()
        self._known: OrderedDict[bytes, float] = OrderedDict()

    def learn(self, request: JobRequest, cpu_seconds: float) -> None:
        """Keep a price; the oldest is forgotten."""
        with self._lock:
            self._known[_name(request)] = cpu_seconds
            while len(self._known) > KEPT_PRICES:
                self._known.popitem(last=False)

    def get(self, request: JobRequest) -> float | None:
        """CPU seconds of the same scene at the same quality, if that was quoted."""
        with self._lock:
            return self._known.get(_name(request))


def _name(request: JobRequest) -> bytes:
    """Digest of all that a price depends on; what layers cost is little."""
    content = request.model_dump_json(include={"scene", "quality"}, exclude_unset=True)
    return hashlib.sha256(content.encode()).digest()
