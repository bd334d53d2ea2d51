"""One command as a process: its streams, its signals, and the way from any outcome to an exit code."""

from __future__ import annotations

import sys
from collections.abc import Callable, Sequence
from typing import NoReturn

from service.cli import streams
from service.cli.errors import CommandError
from service.cli.exits import ExitCode
from service.cli.signals import Signals


def run(words: Sequence[str]) -> NoReturn:
    """Run the command of these words as this process, and leave with its exit code."""
    streams.guard()
    signals = Signals(as_json=_as_json(words))
    signals.end_at_once()
    # Loading the commands takes a quarter of a second.
    import service.cli.commands  # noqa: F401

    signals.raise_exceptions()
    try:
        code = outcome(words, signals)
    except KeyboardInterrupt:
        # It came after the command, and before the line that sees to signals from there on.
        code = ExitCode.INTERRUPTED
    streams.settle()
    sys.exit(code)


def outcome(words: Sequence[str], signals: Signals | None = None) -> int:
    """Run the command of these words, report what goes wrong, and give the exit code."""
    from service.cli import commands

    code, failure = _tried(commands.run, words)
    if signals is not None:
        # Only words are left, and the interpreter's own end, which a signal would litter with tracebacks.
        signals.end_at_once()
    ended = None if signals is None else signals.code
    if signals is not None and ended is not None and (failure is not None or code == ended):
        signals.report()
        return ended
    return code if failure is None else _reported(failure, as_json=_as_json(words))


def _as_json(words: Sequence[str]) -> bool:
    return "--json" in words


def _tried(run: Callable[[Sequence[str]], int], words: Sequence[str]) -> tuple[int, BaseException | None]:
    """The exit code of a command, or what it raised."""
    try:
        code = run(words)
        sys.stdout.flush()
    except SystemExit as leaving:
        return (leaving.code if isinstance(leaving.code, int) else ExitCode.DONE), None
    except BaseException as error:  # noqa: BLE001 - failures.py decides what each of them means
        return ExitCode.INTERNAL, error
    return code, None


def _reported(failure: BaseException, *, as_json: bool) -> ExitCode:
    from service.cli.failures import report

    try:
        return report(failure, as_json=as_json and streams.settle())
    except CommandError as lost:
        # stdout does not even take the news.
        return report(lost, as_json=False)
    except SystemExit:
        return ExitCode.READER_GONE
