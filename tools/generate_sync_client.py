"""The client that blocks, made from the asynchronous one: `python tools/generate_sync_client.py`.

Each rule is a regular expression, applied to code and docstrings alike, so that examples follow. Ruff then
sorts imports, drops those that only the asynchronous client needs, and formats.
"""

import re
import subprocess
import sys
from pathlib import Path

CLIENT = Path(__file__).parents[1] / "service" / "client"
SOURCES = {f"async_{name}.py": f"{name}.py" for name in ("client", "connection", "jobs", "operations")}
HEADER = "# Generated from {source} by tools/generate_sync_client.py: edit that file, then run this script.\n"

RULES = [
    (r"\basync (def|for|with)\b", r"\1"),
    # A function that runs in a thread, so that it does not block the event loop, is simply called.
    (r"\bawait to_thread\.run_sync\((\w+), ", r"\1("),
    (r"\bawait ", ""),
    (r"\bAwaitable\[(npt\.NDArray\[Any\])\]", r"\1"),
    (r"\bAsync(?=[A-Z])", ""),
    (r"\basync_(?=[a-z])|_async\b", ""),
    (r"\b__a(enter|exit)__", r"__\1__"),
    (r"\basynccontextmanager\b", "contextmanager"),
    (r"\ba(close|closing|read)\b", r"\1"),
    (r"\basyncio\b", "time"),
    (r"\basynchronous\b", "synchronous"),
]

# Imports that are sorted and used, `yield from` in place of a loop.
MENDED = "--select=I,F401,UP028"


def translated(source: str) -> str:
    """The synchronous module that stands for an asynchronous one, as text that is still to be formatted."""
    for pattern, replacement in RULES:
        source = re.sub(pattern, replacement, source)
    return source


def generated(source: str) -> str:
    """The text of the synchronous module of a file of `SOURCES`."""
    target = CLIENT / SOURCES[source]
    text = HEADER.format(source=source) + translated((CLIENT / source).read_text())
    mended = _ruff("check", target, text, "--fix-only", "--unsafe-fixes", MENDED)
    return _ruff("format", target, mended)


def _ruff(command: str, target: Path, text: str, *options: str) -> str:
    line = [sys.executable, "-m", "ruff", command, "--quiet", *options, "--stdin-filename", str(target), "-"]
    return subprocess.run(line, input=text, stdout=subprocess.PIPE, text=True, check=True, cwd=CLIENT).stdout


def main() -> None:
    """Write all of them."""
    for source, target in SOURCES.items():
        (CLIENT / target).write_text(generated(source))


if __name__ == "__main__":
    main()
