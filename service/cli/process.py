"""A command as a process: streams, signals, and the exit code of every outcome."""

from __future__ import annotations

import io
import os
import signal
import sys
import time
from collections.abc import Callable, Sequence
from pathlib import Path
from types import FrameType
from typing import TYPE_CHECKING, NoReturn, TextIO

from service.cli.errors import CommandError, ExitCode

if TYPE_CHECKING:
    from sys import UnraisableHookArgs

    from _typeshed import ReadableBuffer


def run(arguments: Sequence[str]) -> NoReturn:
    """Run a command as this process, and exit with its code."""
    guard_streams()
    signals = Signals(as_json=_as_json(arguments))
    signals.end_at_once()
    # Loading the commands takes a quarter of a second.
    import service.cli.commands  # noqa: F401

    signals.raise_exceptions()
    try:
        code = outcome(arguments, signals)
    except KeyboardInterrupt:
        # The signal came after the command, before its handlers were changed.
        code = ExitCode.INTERRUPTED
    settle_stdout()
    sys.exit(code)


def outcome(arguments: Sequence[str], signals: Signals | None = None) -> int:
    """Run a command, report what goes wrong, and return the exit code."""
    from service.cli import commands

    code, failure = _tried(commands.run, arguments)
    if signals is not None:
        # Only messages are left, and the end of the interpreter, where a signal would print tracebacks.
        signals.end_at_once()
    ended = None if signals is None else signals.code
    if signals is not None and ended is not None and (failure is not None or code == ended):
        signals.report()
        return ended
    return code if failure is None else _reported(failure, as_json=_as_json(arguments))


def _as_json(arguments: Sequence[str]) -> bool:
    return "--json" in arguments


def _tried(run: Callable[[Sequence[str]], int], arguments: Sequence[str]) -> tuple[int, BaseException | None]:
    """The exit code of a command, or what it raised."""
    try:
        code = run(arguments)
        sys.stdout.flush()
    except SystemExit as leaving:
        return (leaving.code if isinstance(leaving.code, int) else ExitCode.DONE), None
    except BaseException as error:  # noqa: BLE001 - failures.py decides what each of them means
        return ExitCode.INTERNAL, error
    return code, None


def _reported(failure: BaseException, *, as_json: bool) -> ExitCode:
    from service.cli.failures import report

    try:
        return report(failure, as_json=as_json and settle_stdout())
    except CommandError as lost:
        # stdout is not writable at all.
        return report(lost, as_json=False)
    except SystemExit:
        return ExitCode.READER_GONE


STDOUT, STDERR = 1, 2


def guard_streams() -> None:
    """Replace stdout and stderr by streams that handle write errors.

    A stream that was replaced before, as by a test, stays.
    """
    _open_missing()
    if sys.stdout is sys.__stdout__:
        sys.stdout = _text(_Results(STDOUT, "wb", closefd=False), sys.__stdout__)
    if sys.stderr is sys.__stderr__:
        sys.stderr = _text(_Messages(STDERR, "wb", closefd=False), sys.__stderr__)


def settle_stdout() -> bool:
    """Flush stdout; if that fails, drop what is left and return False.

    The interpreter would try again as it ends, and complain.
    """
    try:
        sys.stdout.flush()
    except (CommandError, SystemExit):
        nowhere = os.open(os.devnull, os.O_WRONLY)
        os.dup2(nowhere, STDOUT)
        os.close(nowhere)
        return False
    return True


class _Results(io.FileIO):
    def write(self, content: ReadableBuffer, /) -> int:
        try:
            return super().write(content)
        except BrokenPipeError:
            # As in `penumbra ls | head -1`: the reader has closed the pipe.
            raise SystemExit(ExitCode.READER_GONE) from None
        except OSError as error:
            raise CommandError(
                f"{_path()} cannot be written: {error.strerror}. Free some space there, or write elsewhere."
            ) from error


class _Messages(io.FileIO):
    def write(self, content: ReadableBuffer, /) -> int:
        try:
            return super().write(content)
        except OSError:
            # The result matters more than messages about it.
            return memoryview(content).nbytes


def _text(file: io.FileIO, like: TextIO | None) -> io.TextIOWrapper:
    return io.TextIOWrapper(
        io.BufferedWriter(file),
        encoding=like.encoding if like else "utf-8",
        # Do not fail for a name that the encoding cannot represent.
        errors="backslashreplace",
        line_buffering=file.fileno() == STDERR or file.isatty(),
    )


def _path() -> str:
    """The name of stdout, as far as the system knows it."""
    try:
        return f"stdout ({Path(f'/proc/self/fd/{STDOUT}').readlink()})"
    except OSError:
        return "stdout"


def _open_missing() -> None:
    """Open descriptors that were closed (``>&-``): the next file would take their number and the messages."""
    for number in (0, STDOUT, STDERR):
        try:
            os.fstat(number)
        except OSError:
            os.open(os.devnull, os.O_RDWR)


CODES = {
    signal.SIGINT: ExitCode.INTERRUPTED,
    signal.SIGTERM: ExitCode.TERMINATED,
    signal.SIGHUP: ExitCode.HUNG_UP,
}
CLEAN_UP_SECONDS = 1.0
"""Most seconds for clean-up; removing files and ending workers takes a tenth of that."""

AGAIN_SECONDS = 0.01
"""Wait for the end of a finalizer that dropped a signal's exception, seconds."""

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
        # Signals that were ignored from the start stay ignored: nohup, background jobs of a script.
        self._heard = [each for each in CODES if signal.getsignal(each) is not signal.SIG_IGN]

    def end_at_once(self) -> None:
        """From here on a signal ends the process at once: there is nothing to clean up."""
        signal.setitimer(signal.ITIMER_REAL, 0)
        for number in self._heard:
            signal.signal(number, self._end)

    def raise_exceptions(self) -> None:
        """From here on a signal raises an exception, so that files and processes are cleaned up."""
        for number in self._heard:
            signal.signal(number, self._raise)
        sys.unraisablehook = self._raise_later

    def report(self) -> None:
        """Say that the command was interrupted. SIGTERM and SIGHUP need no message: their sender knows."""
        if self.code != ExitCode.INTERRUPTED:
            return
        # Not through sys.stdout, which may have been left in the middle of a line.
        descriptor, message = (1, INTERRUPTED) if self._as_json else (2, "error: Interrupted.")
        try:
            os.write(descriptor, f"{message}\n".encode())
        except OSError:
            return

    def _raise_later(self, dropped: UnraisableHookArgs) -> None:
        """Raise again what Python dropped because the signal came in a finalizer or a callback of weakref."""
        value = dropped.exc_value
        if self.code is None or not isinstance(value, KeyboardInterrupt | SystemExit):
            sys.__unraisablehook__(dropped)
            return

        def again(_number: int, _frame: FrameType | None) -> NoReturn:
            raise value

        signal.signal(signal.SIGALRM, again)
        signal.setitimer(signal.ITIMER_REAL, AGAIN_SECONDS)

    def _end(self, number: int, _frame: FrameType | None) -> NoReturn:
        if self.code is None:
            self.code = CODES[signal.Signals(number)]
            self.report()
        os._exit(self.code)

    def _raise(self, number: int, frame: FrameType | None) -> None:
        if self.code is not None:
            # Repeated Ctrl-C must not interrupt the clean-up.
            if time.monotonic() > self._first + CLEAN_UP_SECONDS:
                self._end(number, frame)
            return
        self.code, self._first = CODES[signal.Signals(number)], time.monotonic()
        if number == signal.SIGINT:
            raise KeyboardInterrupt
        if number == signal.SIGHUP and signal.getsignal(signal.SIGTERM) != self._raise:
            # A service handles SIGTERM itself and lets requests in progress end; it does not handle SIGHUP.
            signal.raise_signal(signal.SIGTERM)
            return
        sys.exit(self.code)
