"""Faults that tests try with real parts: `make chaos` runs these tests, and reports how many passed."""

from __future__ import annotations

import re
import subprocess
import sys
from pathlib import Path
from typing import TYPE_CHECKING

from benchmarks.load.promises import Promise, promise

if TYPE_CHECKING:
    from collections.abc import Iterator

FOLDER = Path(__file__).parents[2] / "tests" / "integration"
TESTED = {
    "a worker of a former leader that resumes late replaces no picture": ["test_fences.py"],
    "a bucket that stalls delays only what needs it": ["test_stalled_store.py"],
    "four PNG files of 4096 x 2160 pixels at once fit into a server of 1 GiB": ["test_large_pictures.py"],
    "crowds of connections and streams leave room for probes and others": ["test_crowds.py"],
    "a full disk makes jobs wait, and deleting cures it": ["test_disks.py"],
    "what still imports for workers dies with its server": ["test_deaths.py", "-k", "imports"],
}
_COUNT = re.compile(r"(\d+) (passed|failed|skipped|errors?)\b")


def findings() -> Iterator[Promise]:
    """Run the tests of one promise after another."""
    for sentence, (file, *options) in TESTED.items():
        words = ["-m", "pytest", "-q", "-n0", str(FOLDER / file), *options]
        ran = subprocess.run([sys.executable, *words], check=False, capture_output=True, text=True)
        counts = {what: int(count) for count, what in _COUNT.findall(ran.stdout.rpartition("\n\n")[2])}
        measured = ", ".join(f"{count} {what}" for what, count in counts.items()) or "no test ran"
        held = ran.returncode == 0 and counts.get("passed", 0) > 0
        yield promise(sentence, f"tests: {measured}", held=held, limit="all pass", **counts)
