"""Structured logs on stderr: for people on a terminal, one JSON object per line elsewhere."""

from __future__ import annotations

import logging
import sys
import threading
from collections.abc import Callable, Hashable
from types import TracebackType

import structlog
from structlog.typing import EventDict

# Without the values of local names: keys of users may be among them.
_TRACEBACKS = structlog.processors.ExceptionRenderer(
    structlog.tracebacks.ExceptionDictTransformer(show_locals=False)
)
# Enough to see an attack begin, last and end, without filling the disk.
BURST_SECONDS = 1.0


Line = Callable[[dict[str, int]], None]
"""Writes a line with the fields that it is given."""


class Bursts:
    """Writes one line of each kind a second: the first at once, and then how many more there were.

    Strangers can cause any number of lines, such as one for each malformed request.
    """

    def __init__(self) -> None:
        self._lock = threading.Lock()
        self._lines: dict[Hashable, tuple[int, Line]] = {}

    def write(self, kind: Hashable, line: Line) -> None:
        """Have a line written now, or at the end of this second with the ``count`` of those like it."""
        with self._lock:
            is_first = kind not in self._lines
            count = 0 if is_first else self._lines[kind][0] + 1
            self._lines[kind] = count, line
        if is_first:
            line({})
            self._wait(kind)

    def _wait(self, kind: Hashable) -> None:
        timer = threading.Timer(BURST_SECONDS, self._end, [kind])
        timer.daemon = True
        timer.start()

    def _end(self, kind: Hashable) -> None:
        """End a second of a kind; if more lines came in it, another one begins."""
        with self._lock:
            count, line = self._lines.pop(kind)
            if count:
                self._lines[kind] = 0, line
        if count:
            line({"count": count})
            self._wait(kind)


bursts = Bursts()


class _Handler(logging.StreamHandler):  # type: ignore[type-arg]
    """Writes the records of libraries; of those without a traceback one of each kind a second.

    The lines of code that write are the kinds: texts may have parts of requests. Python itself shows a
    warning once.
    """

    def emit(self, record: logging.LogRecord) -> None:
        if record.exc_info or record.name == "py.warnings":
            super().emit(record)
        else:
            bursts.write((record.pathname, record.lineno), lambda more: self._emit(record, more))

    def _emit(self, record: logging.LogRecord, more: dict[str, int]) -> None:
        vars(record).update(more)
        super().emit(record)


def _harmless(_logger: object, _method: str, event: EventDict) -> EventDict:
    """Write out control characters: text from outside neither begins lines nor steers a terminal."""
    for name, value in event.items():
        if isinstance(value, str) and not value.isprintable():
            event[name] = "".join(one if one.isprintable() else repr(one)[1:-1] for one in value)
    return event


def configure(level: str) -> None:
    """Send all that this process reports to stderr: logs, warnings, and exceptions that nothing handles."""
    terminal = sys.stderr.isatty()
    for_people = structlog.dev.ConsoleRenderer(exception_formatter=structlog.dev.plain_traceback)
    renderers: list[structlog.typing.Processor] = (
        [for_people] if terminal else [_TRACEBACKS, structlog.processors.JSONRenderer()]
    )
    shared: list[structlog.typing.Processor] = [
        structlog.contextvars.merge_contextvars,
        structlog.processors.add_log_level,
        _harmless,
        structlog.processors.TimeStamper(fmt="iso", utc=True),
    ]
    structlog.configure(
        processors=[*shared, *renderers],
        logger_factory=structlog.PrintLoggerFactory(sys.stderr),
        wrapper_class=structlog.make_filtering_bound_logger(level),
        cache_logger_on_first_use=True,
    )
    handler = _Handler(sys.stderr)
    handler.setFormatter(
        structlog.stdlib.ProcessorFormatter(
            foreign_pre_chain=[structlog.stdlib.ExtraAdder(["count"]), *shared],
            processors=[structlog.stdlib.ProcessorFormatter.remove_processors_meta, *renderers],
        )
    )
    logging.basicConfig(handlers=[handler], level=logging.WARNING, force=True)
    logging.captureWarnings(capture=True)
    sys.excepthook = _report
    threading.excepthook = lambda died: _report(died.exc_type, died.exc_value, died.exc_traceback)
    dropped = sys.unraisablehook

    def report_dropped(lost: sys.UnraisableHookArgs) -> None:
        # A command raises these again: they are signals that came in a finalizer.
        if issubclass(lost.exc_type, KeyboardInterrupt | SystemExit):
            dropped(lost)
        else:
            _report(lost.exc_type, lost.exc_value, lost.exc_traceback)

    sys.unraisablehook = report_dropped


def _report(kind: type[BaseException], error: BaseException | None, traceback: TracebackType | None) -> None:
    """Log an exception that nothing has handled."""
    if error is not None and not issubclass(kind, KeyboardInterrupt | SystemExit):
        structlog.get_logger().critical("unhandled exception", exc_info=(kind, error, traceback))
