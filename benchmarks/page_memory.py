"""Whether the live page keeps memory of the jobs that it has shown: the browser's heap, job after job.

``python -m benchmarks.page_memory`` starts a service, opens the page in Chromium and watches one job after
another to its end without loading the page again, as a person does who goes from one to the next. It needs
chromium and playwright.
"""

from __future__ import annotations

import argparse
import tempfile
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

import httpx2
import numpy as np
from playwright.sync_api import CDPSession, Page, sync_playwright
from rich.console import Console
from rich.table import Table

from benchmarks.page_paint import ball, chromium
from service.server import running
from service.settings import Settings

if TYPE_CHECKING:
    from collections.abc import Iterator

WARM_UP = 10
"""Jobs after which modules are loaded and code is compiled: what is kept from then on would be a leak."""

GO = """async (path) => (await import("/web/navigation.js")).navigate(path)"""
SHOWN = """(id) => location.pathname.endsWith(id)
    && document.querySelector(".state")?.textContent.includes("finished")"""


class Memory(NamedTuple):
    """What the page holds after a collection of garbage."""

    heap: float
    """Bytes of objects."""
    arrays: float
    """Bytes of array buffers."""
    nodes: float
    """Elements of the document and those that only scripts still know."""
    listeners: float


def main() -> None:
    """Watch jobs, and print how memory grows with them."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks.page_memory", description=__doc__)
    parser.add_argument("--jobs", type=int, default=200, help="jobs to watch")
    parser.add_argument("--side", type=int, default=64, help="pixels along a side of their pictures")
    options = parser.parse_args()
    if options.jobs <= WARM_UP + 1:
        parser.error(f"--jobs must be at least {WARM_UP + 2}: memory is compared from job {WARM_UP} on.")
    _print(list(_measured(options.jobs, options.side)))


def _measured(jobs: int, side: int) -> Iterator[Memory]:
    executable = chromium()
    with (
        tempfile.TemporaryDirectory() as folder,
        running(Settings(data=Path(folder), port=0, log_level="error")) as server,
        httpx2.Client(base_url=server.url, timeout=60) as client,
        sync_playwright() as playwright,
    ):
        browser = playwright.chromium.launch(executable_path=executable, args=["--no-sandbox"])
        page = browser.new_page()
        page.goto(f"{server.url}/jobs")
        session = page.context.new_cdp_session(page)
        for number in range(jobs):
            _watch(page, client, _scene(side, number))
            yield _memory(session)
        browser.close()


def _watch(page: Page, client: httpx2.Client, scene: dict[str, Any]) -> None:
    job = client.post("/v1/jobs", json={"scene": scene}).raise_for_status().json()["id"]
    page.evaluate(GO, f"/jobs/{job}")
    page.wait_for_function(SHOWN, arg=job)


def _memory(session: CDPSession) -> Memory:
    session.send("HeapProfiler.collectGarbage")
    usage = session.send("Runtime.getHeapUsage")
    counters = session.send("Memory.getDOMCounters")
    return Memory(
        usage["usedSize"], usage["backingStorageSize"], counters["nodes"], counters["jsEventListeners"]
    )


def _scene(side: int, seed: int) -> dict[str, Any]:
    """The seed makes it another, so that it is not answered from a stored result."""
    sampling = {"antialiasing": {"pattern": "random", "samples": 4}, "seed": seed}
    return ball(side, name=f"job {seed}", sampling=sampling)


def _print(measured: list[Memory]) -> None:
    table = Table(title=f"Memory of the page over {len(measured)} watched jobs")
    for heading in ("", f"after {WARM_UP} jobs", f"after {len(measured)} jobs", "growth a job"):
        table.add_column(heading, justify="right" if heading else "left")
    later = np.array(measured[WARM_UP - 1 :])
    slopes = np.polynomial.polynomial.polyfit(np.arange(len(later)), later, 1)[1]
    for name, unit, first, last, slope in zip(
        ("objects", "array buffers", "nodes", "listeners"),
        ("kB", "kB", "", ""),
        later[0],
        later[-1],
        slopes,
        strict=True,
    ):
        scale = 1000 if unit else 1
        table.add_row(
            name, *(f"{value / scale:,.0f} {unit}" for value in (first, last)), f"{slope / scale:.2f} {unit}"
        )
    Console().print(table)


if __name__ == "__main__":
    main()
