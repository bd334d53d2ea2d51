"""Write docs/explanation/costs.md from the kept figures of `make bench` and of the live page."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

from benchmarks.effects import SIDE
from benchmarks.quotes import NEAR
from benchmarks.settings import Setting
from tools.docs import figures
from tools.docs.templates import table

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator

PAGE = Path(__file__).parents[2] / "docs" / "explanation" / "costs.md"
TEMPLATE = Path(__file__).with_name("costs_template.txt")

Figures = Mapping[str, Any]

WAYS = {
    "command": "`penumbra render`, start of Python and its workers included",
    "call": "`renderer.render`, start of its workers included",
    "service": "a running service, until the linear image has arrived",
    "first_pixels": "a running service, until the first pixels have arrived",
}


def page(bench: Figures, jobs: Figures, full: Figures, live: Figures) -> str:
    """The template with the tables in their places."""
    burst = jobs["bursts"]["different"]
    return TEMPLATE.read_text(encoding="utf-8").format(
        bench_machine=figures.measured_on(bench["machine"]),
        rendering=table(("samples", "CPU seconds", "shadow rays a second"), _rendering(bench["rendering"])),
        side=SIDE,
        effects=table(("effect", "without", "with", "ratio", "ratio at zero"), _effects(bench["effects"])),
        meshes=table(
            ("triangles", "CPU seconds", "times the ellipsoid", "tree, CPU seconds"), _meshes(bench["meshes"])
        ),
        workers=bench["service"]["workers"],
        service=table(("way", "seconds"), _service(bench["service"])),
        users=burst["users"],
        jobs=burst["jobs"],
        jobs_machine=figures.measured_on(jobs["machine"]),
        bursts=table(("", "a scene for each job", "one scene for all"), _bursts(jobs["bursts"])),
        quotes=table(
            ("", "quotes", f"within {NEAR:.0%}", "in their interval", "measured / quoted, median"),
            _quotes(jobs["quotes"]),
        ),
        queued=full["lists"]["queued"],
        kept=full["lists"]["kept"],
        lists_machine=figures.measured_on(full["machine"]),
        lists=table(("", "CPU ms", "statements", "files listed"), _lists(full["lists"]["looks"])),
        longest_pilot=jobs["quotes"]["longest_pilot"],
        page_runs=next(iter(live["milliseconds"].values()))["runs"],
        page_machine=figures.measured_on(live["machine"]),
        page=table(("what", "median", "least", "most"), _live(live["milliseconds"])),
    )


def _rendering(timings: Iterable[Figures]) -> Iterator[tuple[str, ...]]:
    for timing in timings:
        rate = f"{timing['shadow_rays_a_second'] / 1e6:.1f} million"
        yield Setting(**timing["setting"]).name, f"{timing['cpu_seconds']['median']:.3g}", rate


def _effects(costs: Iterable[Figures]) -> Iterator[tuple[str, ...]]:
    for cost in costs:
        seconds = (f"{cost[way]['least']:.3f}" for way in ("without", "asked"))
        zero = "" if cost["zero_ratio"] is None else f"{cost['zero_ratio']:.2f}"
        yield cost["effect"], *seconds, f"{cost['ratio']:.2f}", zero


def _meshes(timings: list[Figures]) -> Iterator[tuple[str, ...]]:
    ellipsoid = timings[0]["cpu_seconds"]["median"]
    for timing in timings:
        seconds = timing["cpu_seconds"]["median"]
        tree = f"{timing['tree_seconds']:.2f}" if timing["triangles"] else ""
        name = f"{timing['triangles']:,}" if timing["triangles"] else "ellipsoid"
        yield name, f"{seconds:.3g}", f"{seconds / ellipsoid:.1f}", tree


def _service(overhead: Figures) -> Iterator[tuple[str, ...]]:
    for way, words in WAYS.items():
        yield words, f"{overhead[way]['median']:.3g}"


def _bursts(bursts: Figures) -> Iterator[tuple[str, ...]]:
    both = bursts["different"], bursts["same"]
    yield "refused and sent again", *(f"{burst['refusals']}" for burst in both)
    yield "lost", *(f"{burst['lost']}" for burst in both)
    yield "accepted a second", *(f"{burst['accepts_a_second']:.1f}" for burst in both)
    yield "all finished after", *(f"{burst['seconds']:.1f} s" for burst in both)
    yield "wait of a user", *(_spread(burst["waits"]) for burst in both)
    yield "first tile of a job after", *(_spread(burst["first_tile"]) for burst in both)
    yield "Jain's index of fairness", *(f"{burst['jain']:.4f}" for burst in both)


def _spread(seconds: Figures) -> str:
    return f"{seconds['median']:.2g} s ({seconds['least']:.2g} to {seconds['most']:.2g})"


def _quotes(quotes: Figures) -> Iterator[tuple[str, ...]]:
    for words, mode in (("fixed samples", "fixed"), ("target errors", "target")):
        total = quotes[mode]
        shares = (f"{total['near']:.1%}", f"{total['held']:.1%}")
        yield words, f"{total['predictions']}", *shares, f"{total['median_ratio']:.2f}"


def _lists(looks: Figures) -> Iterator[tuple[str, ...]]:
    for what, look in looks.items():
        yield what, f"{look['cpu_ms']:.1f}", f"{look['statements']}", f"{look['files']:,}"


def _live(milliseconds: Figures) -> Iterator[tuple[str, ...]]:
    for what, times in milliseconds.items():
        yield what, *(f"{times[end]:.1f}" for end in ("median", "least", "most"))
