"""Sends spans to a collector by OTLP over HTTP, as the variables of OpenTelemetry say."""

from __future__ import annotations

import logging
import threading
from collections.abc import Sequence
from importlib.metadata import version
from typing import TYPE_CHECKING

import structlog
from opentelemetry.exporter.otlp.proto.http.trace_exporter import OTLPSpanExporter
from opentelemetry.sdk.resources import OTELResourceDetector, Resource
from opentelemetry.sdk.trace import ReadableSpan, SpanProcessor, TracerProvider
from opentelemetry.sdk.trace.export import BatchSpanProcessor, SpanExporter, SpanExportResult

from service.storage.database.connection import Database
from service.telemetry.jobs import Ids, SentJobSpans
from service.telemetry.spans import Telemetry

if TYPE_CHECKING:
    from collections.abc import MutableMapping
    from typing import Any

    from fastapi.telemetry import TelemetryConfig
    from opentelemetry.context import Context
    from opentelemetry.sdk.trace import Span

# Seconds for sending the last spans when the service stops.
FAREWELL_SECONDS = 3.0
# Machines poll these addresses all the time.
NOT_TRACED = {"/livez", "/readyz", "/metrics"}
REQUEST = "penumbra.request"

log = structlog.get_logger()


class SentTelemetry(Telemetry):
    """Spans of a service, sent in batches by a thread of their own."""

    def __init__(self) -> None:
        ids = Ids()
        own = Resource({"service.name": "penumbra", "service.version": version("penumbra-render")})
        self._provider = TracerProvider(
            resource=own.merge(OTELResourceDetector().detect()), id_generator=ids, shutdown_on_exit=False
        )
        self._provider.add_span_processor(_RequestIds())
        self._provider.add_span_processor(BatchSpanProcessor(_Collector(OTLPSpanExporter())))
        self._ids = ids

    def of_requests(self) -> TelemetryConfig:
        """Instrument the framework: one span for each request."""
        return {
            "tracer_provider": self._provider,
            "metrics": False,
            "logs": False,
            "operation_spans": False,
            "auto_configure": False,
            "exclude": _is_not_traced,
        }

    def of_jobs(self, database: Database) -> SentJobSpans:
        """Return the spans of jobs in a database."""
        return SentJobSpans(self._provider.get_tracer("penumbra"), self._ids, database)

    def close(self) -> None:
        """Send the remaining spans, within a few seconds."""
        # Waiting for an unreachable collector would take longer than a service may take to stop.
        farewell = threading.Thread(target=self._provider.shutdown, name="last spans", daemon=True)
        farewell.start()
        farewell.join(FAREWELL_SECONDS)


def _is_not_traced(scope: MutableMapping[str, Any]) -> bool:
    return scope.get("path") in NOT_TRACED


class _RequestIds(SpanProcessor):
    """Adds the name that a request has in the log to its span."""

    def on_start(self, span: Span, parent_context: Context | None = None) -> None:  # noqa: ARG002  (an interface)
        """Add the id of the current request to a new span."""
        name = structlog.contextvars.get_contextvars().get("request")
        if name is not None:
            span.set_attribute(REQUEST, name)


class _Collector(SpanExporter):
    """Sends spans. An error is logged once, and not with each batch."""

    def __init__(self, exporter: OTLPSpanExporter) -> None:
        # It logs each try of each batch.
        logging.getLogger("opentelemetry.exporter").setLevel(logging.CRITICAL)
        self._exporter = exporter
        self._away = False

    def export(self, spans: Sequence[ReadableSpan]) -> SpanExportResult:
        """Send spans; those that the collector does not take are lost."""
        result = self._exporter.export(spans)
        away = result is not SpanExportResult.SUCCESS
        if away and not self._away:
            log.warning("trace export failed", lost=len(spans))
        elif self._away and not away:
            log.info("trace export resumed")
        self._away = away
        return result

    def force_flush(self, timeout_millis: int = 30_000) -> bool:
        """Wait until all is sent that was given."""
        return bool(self._exporter.force_flush(timeout_millis))

    def shutdown(self) -> None:
        """Send no more."""
        self._exporter.shutdown()
