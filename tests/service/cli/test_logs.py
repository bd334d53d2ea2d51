from __future__ import annotations

from datetime import datetime

from schemas.api.jobs import LogEntry
from service.cli.jobs import _log_by_day, _log_lines

ENTRIES = (
    LogEntry(at=datetime(2026, 5, 1, 23, 59, 58).astimezone(), event="started", message="It began."),
    LogEntry(event="step_repeated", message="Tile 3\x1b of pass 1 was begun 2 times."),
    LogEntry(at=datetime(2026, 5, 2, 0, 0, 1).astimezone(), event="succeeded", message="It is done."),
)


def test_log_on_a_terminal_is_by_day() -> None:
    assert list(_log_by_day(ENTRIES)) == [
        "2026-05-01",
        "  23:59:58  It began.",
        "            Tile 3  of pass 1 was begun 2 times.",
        "2026-05-02",
        "  00:00:01  It is done.",
    ]


def test_log_on_a_pipe_has_a_line_an_entry() -> None:
    assert list(_log_lines(ENTRIES)) == [
        "2026-05-01 23:59:58\tstarted\tIt began.",
        "\tstep_repeated\tTile 3  of pass 1 was begun 2 times.",
        "2026-05-02 00:00:01\tsucceeded\tIt is done.",
    ]
