"""Try every promise about faults: `make chaos`, or `python -m benchmarks.chaos --short`."""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import TYPE_CHECKING

from rich.console import Console

from benchmarks.chaos import jobs, processes, reads, recovery, storage, tested
from benchmarks.chaos.soak import soak
from benchmarks.load.promises import table, write

if TYPE_CHECKING:
    from collections.abc import Iterator

    from benchmarks.load.promises import Promise

MANY_READS = 100_000


def findings(*, short: bool, read: int = MANY_READS) -> Iterator[Promise]:
    """Try one promise after another; a short run has few kills, and ``read`` are the reads over HTTP."""
    expected = processes.undisturbed(2 if short else 8)
    yield processes.workers_killed(3 if short else 200, 4 if short else 100, expected)
    yield processes.server_killed(2 if short else 20, expected)
    yield processes.server_terminated(expected)
    yield processes.worker_stopped(expected)
    yield jobs.ruinous(4 if short else 20)
    yield jobs.clock_set()
    yield storage.disk_full(expected)
    yield storage.database_locked(expected)
    yield storage.torn_reads(2_000 if short else MANY_READS)
    yield reads.reads_over_http(1_000 if short else read)
    times = 2 if short else 15
    yield recovery.started(times)
    yield recovery.worker_killed(times)
    yield recovery.leader_killed(times)
    yield recovery.scheduler_killed(times)
    yield from tested.findings()


def main() -> None:
    """Print a table of what was found, and keep it; fail if a promise was not held."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks.chaos", description="Try faults.")
    parser.add_argument("--short", action="store_true", help="few kills and reads")
    parser.add_argument(
        "--reads", type=int, default=MANY_READS, help="reads over HTTP; 100,000 may take 20 minutes"
    )
    parser.add_argument("--soak", action="store_true", help="random faults among mixed jobs instead")
    parser.add_argument("--minutes", type=float, default=30.0, help="how long to soak; 30 by default")
    parser.add_argument("--out", type=Path, default=Path("out/chaos.json"), help="where to write the figures")
    options = parser.parse_args()
    found = []
    tried = (soak(options.minutes),) if options.soak else findings(short=options.short, read=options.reads)
    for finding in tried:
        found.append(finding)
        Console(stderr=True).print(f"{finding['promise']}: {finding['measured']}")
    Console().print(table(found, "Faults"))
    write(found, options.out)
    if not all(finding["held"] for finding in found):
        raise SystemExit(1)


if __name__ == "__main__":
    main()
