"""Measure the promises under load on this machine: `make load`, or `python -m benchmarks.load watchers`."""

from __future__ import annotations

import argparse
import sys
from pathlib import Path
from typing import TYPE_CHECKING

from rich.console import Console

from benchmarks.load import crowds, memory, neighbours, pace, watchers
from benchmarks.load.promises import Promise, table, write

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator

PARTS: dict[str, Callable[[], Iterator[Promise]]] = {
    "crowds": crowds.measure,
    "neighbours": neighbours.measure,
    "watchers": watchers.measure,
    "memory": memory.measure,
    "pace": pace.measure,
}


def main() -> None:
    """Measure the requested parts, print a table, keep the figures as JSON; 1 if one is not held."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks.load", description=__doc__)
    parser.add_argument("parts", nargs="*", default=[*PARTS], metavar="PART", help=", ".join(PARTS))
    parser.add_argument("--out", type=Path, default=Path("out/load.json"), help="where to write the figures")
    options = parser.parse_args()
    if unknown := set(options.parts) - set(PARTS):
        parser.error(f"no part {', '.join(sorted(unknown))}; there are {', '.join(PARTS)}")
    found: list[Promise] = []
    for part in options.parts:
        Console(stderr=True).print(f"{part} ...")
        found += PARTS[part]()
    write(found, options.out)
    Console().print(table(found, "Under load"))
    Console(stderr=True).print(f"written to {options.out}")
    sys.exit(not all(one["held"] for one in found))


if __name__ == "__main__":
    main()
