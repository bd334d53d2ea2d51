"""A collector of OpenTelemetry spans, by OTLP over HTTP."""

import threading
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer

from opentelemetry.proto.collector.trace.v1.trace_service_pb2 import (
    ExportTraceServiceRequest,
    ExportTraceServiceResponse,
)
from opentelemetry.proto.trace.v1.trace_pb2 import Span as SpanMessage

Value = str | int | float | bool


@dataclass(frozen=True)
class Span:
    """A span as it was sent; ids are hexadecimal, moments nanoseconds since 1970."""

    name: str
    trace: str
    id: str
    parent: str
    links: tuple[str, ...]
    begun: int
    ended: int
    failed: str | None
    attributes: dict[str, Value]
    resource: dict[str, Value]


class Collector:
    """Keeps what it is sent."""

    def __init__(self, port: int) -> None:
        self.url = f"http://127.0.0.1:{port}"
        self._spans: list[Span] = []

    def take(self, body: bytes) -> None:
        for batch in ExportTraceServiceRequest.FromString(body).resource_spans:
            resource = {item.key: item.value.string_value for item in batch.resource.attributes}
            for scope in batch.scope_spans:
                self._spans += [_read(span, resource) for span in scope.spans]

    def spans(self, name: str, **attributes: Value) -> list[Span]:
        """The service's own spans of a name with these attributes."""
        wanted = {f"penumbra.{key}": value for key, value in attributes.items()}
        return [
            span for span in self._spans if span.name == name and wanted.items() <= span.attributes.items()
        ]

    def names(self) -> set[str]:
        return {span.name for span in self._spans}


def _read(span: SpanMessage, resource: dict[str, Value]) -> Span:
    values = {item.key: item.value for item in span.attributes}
    return Span(
        name=span.name,
        trace=span.trace_id.hex(),
        id=span.span_id.hex(),
        parent=span.parent_span_id.hex(),
        links=tuple(link.span_id.hex() for link in span.links),
        begun=span.start_time_unix_nano,
        ended=span.end_time_unix_nano,
        failed=span.status.message if span.status.code == span.status.STATUS_CODE_ERROR else None,
        attributes={key: getattr(value, str(value.WhichOneof("value"))) for key, value in values.items()},
        resource=resource,
    )


@contextmanager
def collecting() -> Iterator[Collector]:
    """Listen on a free port of loopback."""

    class Handler(BaseHTTPRequestHandler):
        def do_POST(self) -> None:
            body = self.rfile.read(int(self.headers["Content-Length"]))
            assert (self.path, self.headers["Content-Type"]) == ("/v1/traces", "application/x-protobuf")
            collector.take(body)
            answer = ExportTraceServiceResponse().SerializeToString()
            self.send_response(200)
            self.send_header("Content-Type", "application/x-protobuf")
            self.send_header("Content-Length", str(len(answer)))
            self.end_headers()
            self.wfile.write(answer)

        def log_message(self, *_: object) -> None:
            """Say nothing."""

    with ThreadingHTTPServer(("127.0.0.1", 0), Handler) as server:
        collector = Collector(server.server_port)
        thread = threading.Thread(target=server.serve_forever, args=(0.05,))
        thread.start()
        try:
            yield collector
        finally:
            server.shutdown()
            thread.join()
