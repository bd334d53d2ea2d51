"""How soon the live page shows something, and how fast it paints and exposes, in Chromium on this machine.

``python -m benchmarks.page_paint`` starts a service, opens its views again and again with an empty cache,
paints 256 tiles at once, changes the exposure of 512 x 512 and of 2000 x 2000 pixels, of the latter draws
layers, differences and a histogram, compares two jobs of that size, and types into a scene of 33,500 lines.
It prints milliseconds, and keeps them as JSON. It needs chromium and playwright; on a machine with other work
the times are too long.
"""

from __future__ import annotations

import argparse
import json
import shutil
import sys
import tempfile
import time
from pathlib import Path
from typing import TYPE_CHECKING, Any

import httpx2
from playwright.sync_api import Browser, Page, sync_playwright

from benchmarks.machine import describe, spread
from service.server import running
from service.settings import Settings

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator

SIDE = 512
"""Pixels along a side of what is painted and exposed."""

LARGE_SIDE = 2000
"""Pixels along a side of a large picture."""


def ball(side: int, **rest: Any) -> dict[str, Any]:
    """A ball under a light; ``rest`` are further members of the scene, such as its sampling."""
    return {
        "version": 1,
        "camera": {
            "position": [0, 0, 4],
            "look_at": [0, 0, 0],
            "vertical_fov": 40,
            "width": side,
            "height": side,
        },
        "materials": {"red": {"type": "phong", "color": [0.8, 0.2, 0.1], "diffuse": 1.0}},
        "shapes": [{"type": "ellipsoid", "center": [0, 0, 0], "radius": 1, "material": "red"}],
        "lights": [{"type": "point", "position": [2, 3, 4], "color": [1, 1, 1]}],
        **rest,
    }


SCENE = ball(
    SIDE,
    background=[0.1, 0.1, 0.1],
    sampling={"antialiasing": {"pattern": "center"}, "light": {"samples": 1}},
)

# The whole picture is on the canvas: no pixel is transparent any more.
COVERED = """() => {
    const canvas = document.querySelector("canvas.pixels");
    if (!canvas) return false;
    const { data } = canvas.getContext("2d").getImageData(0, 0, canvas.width, canvas.height);
    return data.every((code, i) => i % 4 < 3 || code > 0);
}"""
FIRST_PAINT = """() => performance.getEntriesByName("first-contentful-paint")[0]?.startTime ?? null"""
PAINT = """async ([side, tiles]) => {
    const { Film } = await import("/web/views/picture/film.js");
    const { Developer } = await import("/web/views/picture/develop.js");
    const context = new OffscreenCanvas(side, side).getContext("2d", { willReadFrequently: true });
    const developer = new Developer({ context, redraw() {} }, new Film(side, side));
    const across = Math.sqrt(tiles);
    const size = side / across;
    const made = Array.from({ length: tiles }, (_, i) => {
        const [x0, y0] = [size * (i % across), size * Math.floor(i / across)];
        const pixels = Float32Array.from({ length: 3 * size * size }, (_, k) => ((7 * i + k) % 256) / 255);
        return { x0, y0, x1: x0 + size, y1: y0 + size, stride: 1, columns: size, rows: size, pixels };
    });
    developer.take(made);
    return performance.getEntriesByName("penumbra:paint").at(-1).duration;
}"""
WRITE = """async (text) => {
    const { EditorView } = await import("/web/vendor/codemirror/codemirror.js");
    const view = EditorView.findFromDOM(document.querySelector(".editor"));
    view.dispatch({ changes: { from: 0, to: view.state.doc.length, insert: text } });
    view.focus();
    return view.state.doc.lines;
}"""
# From the key until the next frame is painted.
KEY = """async () => {
    const start = performance.now();
    document.execCommand("insertText", false, " ");
    await new Promise(requestAnimationFrame);
    await new Promise((done) => setTimeout(done));
    return performance.now() - start;
}"""
EXPOSED = """() => performance.getEntriesByName("penumbra:expose").at(-1).duration"""
# Each step ends by reading a pixel: a graphics card has finished then.
LARGE = """async ([side, runs]) => {
    const pictures = "/web/views/picture/";
    const { Film } = await import(pictures + "film.js");
    const { Developer } = await import(pictures + "develop.js");
    const { Layer } = await import(pictures + "layers.js");
    const { hasGpuFor } = await import(pictures + "gpu.js");
    const { countClipped, histogramOf } = await import(pictures + "histogram.js");
    const { absolute, drawHeat, metricsOf } = await import("/web/views/compare/differences.js");
    const wave = (i) => 0.6 * (1 + Math.sin(i / 7000)) + ((i * 2654435761) % 1024) / 20480;
    const film = new Film(side, side);
    film.fill(Float32Array.from({ length: 3 * side * side }, (_, i) => wave(i)));
    const other = new Film(side, side);
    other.fill(film.values.map((value, i) => value + (i % 97) / 1000));
    const depths = Float32Array.from({ length: side * side }, (_, i) => wave(i));
    const depth = new Layer("depth", [side, side], depths);
    const gpu = hasGpuFor(side * side);
    const context = new OffscreenCanvas(side, side).getContext("2d", { willReadFrequently: !gpu });
    const developer = new Developer({ context, redraw() {} }, film);
    const heat = new Uint32Array(side * side);
    const steps = {
        "exposure changed": (run) => developer.expose((run % 5) - 2, "srgb"),
        "a layer in false colours": () => developer.show(depth),
        "the difference of two pictures": () => absolute(film, other),
        "the heat map of two pictures": () => drawHeat(film, other, heat),
        "metrics of two pictures": () => metricsOf(film, other, film.whole),
        "a histogram": () => [histogramOf(film), countClipped(film, 0)],
    };
    const times = {};
    for (const [name, step] of Object.entries(steps)) {
        times[name] = [];
        for (let run = -1; run < runs; run++) {
            const start = performance.now();
            step(run + 1);
            context.getImageData(0, 0, 1, 1);
            if (run >= 0) times[name].push(performance.now() - start);
        }
    }
    return { gpu, times };
}"""


def main() -> None:
    """Measure, print the figures and keep them as JSON."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks.page_paint", description=__doc__)
    parser.add_argument("--runs", type=int, default=15, help="runs of everything that is timed")
    parser.add_argument("--out", type=Path, default=Path("out/page.json"), help="where to write the figures")
    options = parser.parse_args()
    if options.runs < 1:
        parser.error("--runs must be at least 1.")
    machine = describe()
    milliseconds = {what: spread(times) for what, times in _measured(options.runs).items()}
    document = json.dumps({"machine": machine, "milliseconds": milliseconds}, indent=2) + "\n"
    options.out.parent.mkdir(parents=True, exist_ok=True)
    options.out.write_text(document)
    sys.stdout.write(document)


def chromium() -> str:
    """The browser of this machine."""
    found = shutil.which("chromium") or shutil.which("chromium-browser")
    if found is None:
        raise SystemExit("There is no chromium on this machine. Install that package.")
    return found


def _measured(runs: int) -> dict[str, list[float]]:
    executable = chromium()
    with (
        tempfile.TemporaryDirectory() as folder,
        running(Settings(data=Path(folder), port=0, log_level="error")) as server,
        sync_playwright() as playwright,
    ):
        job = _finished(server.url, SCENE)
        browser = playwright.chromium.launch(executable_path=executable, args=["--no-sandbox"])
        views = {"begin, `/`": "/", "jobs, `/jobs`": "/jobs", "one job, `/jobs/{id}`": f"/jobs/{job}"}
        times = {
            f"first paint of {name}": list(_first_paints(browser, server.url + path, runs))
            for name, path in views.items()
        }
        page = browser.new_page()
        page.goto(f"{server.url}/jobs/{job}")
        page.wait_for_function(COVERED)
        times["256 tiles painted"] = _repeated(runs, lambda _: page.evaluate(PAINT, [SIDE, 256]))
        times[f"exposure of {SIDE} x {SIDE} pixels changed"] = _repeated(
            runs, lambda run: _exposed(page, run)
        )
        large = page.evaluate(LARGE, [LARGE_SIDE, runs])
        developed = "with a graphics card" if large["gpu"] else "without a graphics card"
        size = f"{LARGE_SIDE} x {LARGE_SIDE} pixels"
        times |= {f"{name}, {size} {developed}": found for name, found in large["times"].items()}
        shown, judged = zip(*_compared(page, server.url, min(runs, 5)), strict=True)
        times[f"two jobs of {size} compared, until the pictures are shown"] = list(shown)
        times[f"two jobs of {size} compared, until the verdict is shown"] = list(judged)
        times["a key typed in a scene of 33,500 lines"] = _typed(page, server.url, runs)
        browser.close()
    return times


def _compared(page: Page, url: str, runs: int) -> Iterator[tuple[float, float]]:
    """Compare two jobs: milliseconds from the address being opened to the pictures, and to the verdict."""
    scenes = (large := ball(LARGE_SIDE, sampling=SCENE["sampling"]), large | {"background": [0.2, 0.1, 0.1]})
    a, b = (_finished(url, scene) for scene in scenes)
    for _ in range(runs):
        start = time.perf_counter()
        page.goto(f"{url}/compare/{a}/{b}")
        page.locator("canvas.pixels").first.wait_for()
        shown = time.perf_counter()
        page.locator("h2.verdict").wait_for(timeout=120_000)
        yield 1000 * (shown - start), 1000 * (time.perf_counter() - start)


def _typed(page: Page, url: str, runs: int) -> list[float]:
    page.goto(url)
    page.get_by_role("button", name="Render", exact=True).and_(page.locator(":enabled")).wait_for()
    # Each shape takes ten lines.
    long = SCENE | {"shapes": SCENE["shapes"] * 3345}
    lines = page.evaluate(WRITE, json.dumps(long, indent=2))
    if not 33_000 < lines < 34_000:
        raise SystemExit(f"The long scene has {lines} lines.")
    return _repeated(runs, lambda _: page.evaluate(KEY))


def _first_paints(browser: Browser, address: str, runs: int) -> Iterator[float]:
    """Open a page as a new visitor does, milliseconds; the first visit does not count."""
    for run in range(runs + 1):
        context = browser.new_context()
        page = context.new_page()
        page.goto(address)
        page.wait_for_function(FIRST_PAINT)
        if run:
            yield page.evaluate(FIRST_PAINT)
        context.close()


def _repeated(runs: int, measure: Callable[[int], float]) -> list[float]:
    """Milliseconds of each run, after one that has the code compiled."""
    return [measure(run) for run in range(runs + 1)][1:]


def _exposed(page: Page, run: int) -> float:
    page.get_by_label("Exposure").fill(str(run % 5 - 2))
    return float(page.evaluate(EXPOSED))


def _finished(url: str, scene: dict[str, Any]) -> str:
    with httpx2.Client(base_url=url, timeout=120) as client:
        job = client.post("/v1/jobs", json={"scene": scene}, headers={"Prefer": "wait=60"})
        document = job.raise_for_status().json()
    if document["state"] != "succeeded":
        raise SystemExit("The picture was not finished within a minute.")
    return str(document["id"])


if __name__ == "__main__":
    main()
