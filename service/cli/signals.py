"""Ctrl-C, SIGTERM and SIGHUP, from the first line of a command to its last."""

from __future__ import annotations

import os
import signal
import sys
import time
from types import FrameType
from typing import NoReturn

from service.cli.exits import ExitCode

CODES = {
    signal.SIGINT: ExitCode.INTERRUPTED,
    signal.SIGTERM: ExitCode.TERMINATED,
    signal.SIGHUP: ExitCode.HUNG_UP,
}
CLEAN_UP_SECONDS = 1.0
"""Removing files and ending workers takes a tenth of this; a signal that comes later finds it stuck."""

INTERRUPTED = '{"type": "about:blank", "title": "Interrupted", "detail": "Interrupted.", "exit_code": 130, '
INTERRUPTED += '"errors": [], "more": 0}'


class Signals:
    """Handles the signals that end a command.

    Attributes
    ----------
    code
        The exit code of the first signal that came, None before. Whatever is raised after it is its
        consequence: extension modules turn an interrupted import into an error of their own.
    """

    def __init__(self, *, as_json: bool) -> None:
        self._as_json = as_json
        self._first = 0.0
        self.code: ExitCode | None = None
        # What was ignored from the start stays so: nohup, and jobs in the background of a script.
        self._heard = [each for each in CODES if signal.getsignal(each) is not signal.SIG_IGN]

    def end_at_once(self) -> None:
        """From here on a signal ends the process on the spot: there is nothing to clean up."""
        for number in self._heard:
            signal.signal(number, self._end)

    def raise_exceptions(self) -> None:
        """From here on a signal raises an exception, so that files and processes are cleaned up."""
        for number in self._heard:
            signal.signal(number, self._raise)

    def report(self) -> None:
        """Say what happened. SIGTERM and SIGHUP need no words: whoever sent them knows."""
        if self.code != ExitCode.INTERRUPTED:
            return
        # Not through sys.stdout, which may have been left in the middle of a line.
        descriptor, words = (1, INTERRUPTED) if self._as_json else (2, "error: Interrupted.")
        try:
            os.write(descriptor, f"{words}\n".encode())
        except OSError:
            return

    def _end(self, number: int, _frame: FrameType | None) -> NoReturn:
        if self.code is None:
            self.code = CODES[signal.Signals(number)]
            self.report()
        os._exit(self.code)

    def _raise(self, number: int, frame: FrameType | None) -> None:
        if self.code is not None:
            # Hammering Ctrl-C must not break the clean-up that the first one began.
            if time.monotonic() > self._first + CLEAN_UP_SECONDS:
                self._end(number, frame)
            return
        self.code, self._first = CODES[signal.Signals(number)], time.monotonic()
        if number == signal.SIGINT:
            raise KeyboardInterrupt
        if number == signal.SIGHUP and signal.getsignal(signal.SIGTERM) != self._raise:
            # A service handles SIGTERM itself and lets requests in progress end; it knows no SIGHUP.
            signal.raise_signal(signal.SIGTERM)
            return
        sys.exit(self.code)
