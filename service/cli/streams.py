"""stdout and stderr of a command where nobody reads them, nothing more fits, or a character is unknown."""

from __future__ import annotations

import io
import os
import sys
from pathlib import Path
from typing import TYPE_CHECKING, TextIO

from service.cli.errors import CommandError
from service.cli.exits import ExitCode

if TYPE_CHECKING:
    from _typeshed import ReadableBuffer

STDOUT, STDERR = 1, 2


def guard() -> None:
    """Replace stdout and stderr by streams that end a command in good order.

    A stream that was put there by somebody else, such as a test, stays.
    """
    _open_missing()
    if sys.stdout is sys.__stdout__:
        sys.stdout = _text(_Results(STDOUT, "wb", closefd=False), sys.__stdout__)
    if sys.stderr is sys.__stderr__:
        sys.stderr = _text(_Talk(STDERR, "wb", closefd=False), sys.__stderr__)


def settle() -> bool:
    """Write what stdout holds back; False where it takes nothing, and then all of it is dropped.

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
            # As in `penumbra ls | head -1`: the reader has what it wants.
            raise SystemExit(ExitCode.READER_GONE) from None
        except OSError as error:
            raise CommandError(
                f"{_path()} cannot be written: {error.strerror}. Free some space there, or write elsewhere."
            ) from error


class _Talk(io.FileIO):
    def write(self, content: ReadableBuffer, /) -> int:
        try:
            return super().write(content)
        except OSError:
            # The result is worth more than the talk about it.
            return memoryview(content).nbytes


def _text(file: io.FileIO, like: TextIO | None) -> io.TextIOWrapper:
    return io.TextIOWrapper(
        io.BufferedWriter(file),
        encoding=like.encoding if like else "utf-8",
        # A name that the encoding does not know is no reason to fail.
        errors="backslashreplace",
        line_buffering=file.fileno() == STDERR or file.isatty(),
    )


def _path() -> str:
    """What stdout is, so far as the system tells."""
    try:
        return f"stdout ({Path(f'/proc/self/fd/{STDOUT}').readlink()})"
    except OSError:
        return "stdout"


def _open_missing() -> None:
    """Where a descriptor was closed (``>&-``) the next file would take its number and receive the talk."""
    for number in (0, STDOUT, STDERR):
        try:
            os.fstat(number)
        except OSError:
            os.open(os.devnull, os.O_RDWR)
