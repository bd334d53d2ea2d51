"""Write docs/explanation/accuracy-costs-time.md from the studies of `make study`.

``python -m tools.docs.generate_accuracy_page`` takes figures and images over from out/study into docs, if all
studies are there; else it writes the page from the figures that are kept.
"""

from __future__ import annotations

import json
import shutil
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from accuracy.study import curves, tables, words
from accuracy.study.pages import table
from accuracy.study.settings import METHODS, PATTERNS, TARGET
from tools.docs import figures, templates

if TYPE_CHECKING:
    from accuracy.study.pages import Table

ROOT = Path(__file__).parents[2]
DOCS = ROOT / "docs"
MEASURED = ROOT / "out" / "study"
PAGE = DOCS / "explanation" / "accuracy-costs-time.md"
TEMPLATE = Path(__file__).with_name("accuracy_template.txt")
FIGURES = figures.FOLDER / "study.json"
IMAGES = DOCS / "images" / "study"

SCENES = {
    "chess": "study",
    "soft": "study",
    "basic": "gallery",
    "normal_texturing": "gallery",
    "lens": "gallery",
    "glass": "gallery",
}
"""Studied scenes, and the folder of each."""

SHOWN = ("uniform", "rotated", "random", "stratified", "sobol", "target", "reference")
"""Whose enlarged parts of the chess board are shown."""

CHESS_POINTS = 4
LIGHT_SAMPLES = 4
"""Light points, and camera samples, of the two comparisons that vary the other one."""

SHOWN_255 = 1.0
"""Error of the summary, in units of 1/255: one code value."""

DIGITS = 5
"""Significant digits of the figures that are kept: more than any table has."""

Results = Mapping[str, Any]


def page(measured: Mapping[str, Results]) -> str:
    """The template with figures in their places."""
    chess, soft, maps = measured["chess"], measured["soft"], measured["normal_texturing"]
    return TEMPLATE.read_text().format(
        shown=words.error(SHOWN_255),
        summary=_summary(measured),
        double=_double(measured),
        chess_points=CHESS_POINTS,
        chess=_chess(chess),
        ratios=_ratios(chess),
        details=_details(chess),
        light_samples=LIGHT_SAMPLES,
        light=_light(soft),
        maps=_block(tables.effects(maps)),
        curves="\n\n".join(_curve(name, results) for name, results in measured.items()),
        halving=_by_scene(measured, tables.methods),
        effects=_by_scene(measured, tables.effects),
        precision=_by_scene(measured, tables.precision),
        machine=_machine(chess["machine"]),
        sizes=_sizes(measured),
    )


def _summary(measured: Mapping[str, Results]) -> str:
    """What `SHOWN_255` costs in each scene, and which effect costs most there."""
    return table(
        (
            "scene",
            "target quality",
            "fastest pattern",
            "times as long",
            "most expensive effect",
            "share of the time",
            "changes the picture by",
        ),
        [(name, *_costs(results), *_most_expensive(results)) for name, results in measured.items()],
    )


def _costs(results: Results) -> tuple[str, str, str]:
    """Seconds of target quality and of the fastest pattern, and their ratio."""
    found = {method: curves.cost_at(line, SHOWN_255) for method, line in _lines(results).items()}
    costs = {method: cost for method, cost in found.items() if cost is not None}
    target = costs.pop(TARGET, None)
    best = min(costs, key=lambda method: costs[method], default=None)
    return (
        tables.NONE if target is None else words.seconds(target),
        tables.NONE if best is None else f"{best}, {words.seconds(costs[best])}",
        tables.NONE if best is None or target is None else words.figure(costs[best] / target),
    )


def _most_expensive(results: Results) -> tuple[str, str, str]:
    """The effect that costs most: its name, its share of the time, and what the picture is without it."""
    for row in results["effects"]:
        # Camera samples multiply all the others: the other tables cover them.
        if row["effect"] != "antialiasing":
            return row["effect"], f"{row['share']:.0%}", words.error(row["difference_255"])
    return (tables.NONE,) * 3


def _double(measured: Mapping[str, Results]) -> str:
    slowest = max((row for results in measured.values() for row in results["precision"]), key=_ratio)
    return (
        f"Double precision takes at most {words.figure(_ratio(slowest))} times as long ({slowest['name']}) "
        f"and changes pictures by at most {words.error(_largest_change(measured))}."
    )


def _ratio(row: Mapping[str, Any]) -> float:
    return float(row["ratio"]["estimate"])


def _largest_change(measured: Mapping[str, Results]) -> float:
    rows = (row for results in measured.values() for row in results["precision"])
    return max(float(row["difference_255"]) for row in rows)


def _lines(results: Results) -> dict[str, list[curves.Row]]:
    """The curve of each method."""
    return {
        method: curves.front([row for row in results["settings"] if row["method"] == method])
        for method in METHODS
    }


def _ratios(results: Results) -> str:
    """How many times as long other patterns take for the error of each setting of `rotated`."""
    lines = _lines(results)
    others = [method for method in PATTERNS if method != "rotated"]
    rows = []
    for row in results["settings"]:
        if row["method"] != "rotated" or row["light_points"] != CHESS_POINTS or row["camera_samples"] < 4:
            continue
        costs = (curves.cost_at(lines[method], curves.error(row)) for method in others)
        ratios = (tables.NONE if cost is None else words.figure(cost / curves.seconds(row)) for cost in costs)
        rows.append((row["name"], words.error(curves.error(row)), *ratios))
    return table(("setting", "its error", *others), rows)


def _chess(results: Results) -> str:
    rows = [
        row
        for row in results["settings"]
        if row["method"] in PATTERNS and row["light_points"] == CHESS_POINTS
    ]
    return table(
        ("camera samples", "pattern", "CPU seconds", "RMSE x 255", "beside edges", "hot pixels"),
        [
            (
                str(row["camera_samples"]),
                row["method"],
                words.figure(curves.seconds(row)),
                words.interval(row["rmse_255"]),
                words.figure(row["edges_rmse_255"]),
                f"{row['hot']:.2%}",
            )
            for row in sorted(rows, key=lambda row: row["camera_samples"])
        ],
    )


def _details(results: Results) -> str:
    captions = {
        row["method"]: f"{row['name']}, {words.seconds(curves.seconds(row))}" for row in results["pictures"]
    }
    shown = [name for name in SHOWN if name in captions or name == "reference"]
    images = [f"![{name}](../images/study/chess-{name}-detail.png)" for name in shown]
    return templates.table(images, [[captions.get(name, "the reference") for name in shown]])


def _light(results: Results) -> str:
    rows = [row for row in results["settings"] if row["camera_samples"] == LIGHT_SAMPLES]
    found = {(row["method"], row["light_points"]): row for row in rows}
    points = sorted({row["light_points"] for row in rows})
    return table(
        ("light points", *PATTERNS),
        [(str(count), *(_light_cell(found.get((method, count))) for method in PATTERNS)) for count in points],
    )


def _light_cell(row: curves.Row | None) -> str:
    if row is None:
        return tables.NONE
    return f"{words.figure(row['smooth_rmse_255'])}, {words.seconds(curves.seconds(row))}"


def _curve(name: str, results: Results) -> str:
    own = words.error(results["reference"]["rmse_255"])
    plot = f"![Error against CPU seconds, a line a method](../images/study/{name}-seconds.svg)"
    return (
        f"**[{name}](../../scenes/{SCENES[name]}/{name}.json)**. The reference's own error is {own}. CPU "
        "seconds to the same error, and how many times the least of them:\n\n"
        f"{_block(tables.equal_error(results))}\n\n{plot}"
    )


def _block(block: Table) -> str:
    return table(block.columns, block.rows)


def _by_scene(measured: Mapping[str, Results], of: Any) -> str:
    return "\n\n".join(f"**{name}**\n\n{_block(of(results))}" for name, results in measured.items())


def _machine(machine: Mapping[str, Any]) -> str:
    return (
        f"Measured on {machine['date'][:10]} on one core of {machine['cpu']} with Python "
        f"{machine['python']}, NumPy {machine['numpy']} and Penumbra {machine['penumbra']}. The load before "
        f"it began was {machine['load']:g}."
    )


def _sizes(measured: Mapping[str, Results]) -> str:
    sizes = {f"{results['width']} x {results['height']}" for results in measured.values()}
    return " or ".join(sorted(sizes)) + " pixels"


def rounded(value: Any) -> Any:
    """The same document with numbers of `DIGITS` significant digits."""
    if isinstance(value, float):
        return float(f"{value:.{DIGITS}g}")
    if isinstance(value, Mapping):
        return {name: rounded(part) for name, part in value.items()}
    return (
        [rounded(part) for part in value]
        if isinstance(value, Sequence) and not isinstance(value, str)
        else value
    )


def images_of(measured: Mapping[str, Results]) -> dict[str, tuple[str, str]]:
    """Images of the page by their names in docs: the scene, and the file in its report."""
    found = {f"{name}-seconds.svg": (name, "seconds.svg") for name in measured}
    found["soft-light.svg"] = ("soft", "light.svg")
    for name in (*(row["method"] for row in measured["chess"]["pictures"]), "reference"):
        found[f"chess-{name}-detail.png"] = ("chess", f"{name}-detail.png")
    return found


def main() -> None:
    """Take over figures and images where there are new ones, and write the page."""
    if all((MEASURED / name / "results.json").exists() for name in SCENES):
        _take_over()
    PAGE.write_text(page(figures.read("study")))
    print(f"wrote {PAGE}")


def _take_over() -> None:
    measured = {name: rounded(json.loads((MEASURED / name / "results.json").read_text())) for name in SCENES}
    IMAGES.mkdir(parents=True, exist_ok=True)
    for name, (scene, file) in images_of(measured).items():
        shutil.copyfile(MEASURED / scene / "images" / file, IMAGES / name)
    FIGURES.write_text(json.dumps(measured, separators=(",", ":")) + "\n")
    print(f"took over the studies of {MEASURED}")


if __name__ == "__main__":
    main()
