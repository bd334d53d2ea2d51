"""Spans of the service's work: dropped, unless ``sending.py`` sends them.

A request that submits a job has a span, in the client's trace if the request names one. Below it the job has
a span from acceptance to its end, and below that each attempt at a tile has one.
"""

from __future__ import annotations

import os
from typing import TYPE_CHECKING

import structlog

from service.storage.database.connection import Database
from service.workers.tasks import JobTask, Outcome

if TYPE_CHECKING:
    from fastapi.telemetry import TelemetryConfig

# Standard variables for the address of the collector; the first is only for spans.
ENDPOINTS = ("OTEL_EXPORTER_OTLP_TRACES_ENDPOINT", "OTEL_EXPORTER_OTLP_ENDPOINT")
MISSING = "They need packages of OpenTelemetry. Install them with: pip install 'penumbra-render[traces]'"

log = structlog.get_logger()


class JobSpans:
    """Spans of jobs and of attempts at their tiles, dropped."""

    def here(self) -> str | None:
        """The current span as a ``traceparent``; None if there is none."""
        return None

    def taken(self, job: str, render: str | None, *, shared: bool) -> None:
        """Record in the current span which job it submitted, and which render that shares."""

    def handed_out(self, task: JobTask) -> None:
        """Begin an attempt."""

    def came_back(self, task: JobTask, outcome: Outcome) -> None:
        """End an attempt."""

    def ended(self, render: str) -> None:
        """Record what was rendered, once it has ended and the database knows it."""


class Telemetry:
    """Spans of a service, dropped."""

    def of_requests(self) -> TelemetryConfig:
        """Instrument the framework."""
        return {"tracing": False, "metrics": False, "logs": False, "auto_configure": False}

    def of_jobs(self, database: Database) -> JobSpans:  # noqa: ARG002  (an interface)
        """Return the spans of jobs in a database."""
        return JobSpans()

    def close(self) -> None:
        """Send the remaining spans, within a few seconds."""


SILENT = Telemetry()
"""For services without a collector."""


def wanted_by() -> str | None:
    """Name the variable that says where to send spans; None if they are dropped."""
    if os.environ.get("OTEL_SDK_DISABLED", "").strip().lower() == "true":
        return None
    if os.environ.get("OTEL_TRACES_EXPORTER", "otlp").strip() == "none":
        return None
    return next((name for name in ENDPOINTS if os.environ.get(name)), None)


def begin() -> Telemetry:
    """Begin to send spans, where the environment says where to."""
    if wanted_by() is None:
        return SILENT
    try:
        from service.telemetry.sending import SentTelemetry  # noqa: PLC0415  (an extra)
    except ImportError:
        log.warning("tracing disabled", reason=MISSING)
        return SILENT
    return SentTelemetry()
