"""The first lines of every command. They import next to nothing: Ctrl-C may come while libraries load."""

from __future__ import annotations

import signal
import sys


def main(arguments: list[str] | None = None) -> None:
    """Run one command and leave with its exit code."""
    if signal.getsignal(signal.SIGINT) is signal.default_int_handler:
        # The default handler ends without a traceback.
        signal.signal(signal.SIGINT, signal.SIG_DFL)
    from service.cli.process import run

    run(sys.argv[1:] if arguments is None else arguments)


if __name__ == "__main__":
    main()
