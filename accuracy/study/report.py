"""The report of a study: its blocks, in order, and its files."""

from __future__ import annotations

import csv
import io
import json
from typing import TYPE_CHECKING, Any

from accuracy.study import answers, figures, pages, tables
from accuracy.study.curves import rays, seconds
from accuracy.study.figures import DIFFERENCE_GAIN, file_names
from accuracy.study.journal import IDLE_LOAD
from accuracy.study.pages import Block, Heading, Paragraph, Plot, Points, Strip
from accuracy.study.words import error, interval
from accuracy.study.words import seconds as duration

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping

    from accuracy.study.running import Study

LIGHT_PLOT_SAMPLES = 4
"""Camera samples of the plot against light points: the fewest with which all numbers of points are tried."""

CSV_COLUMNS = (
    "name",
    "method",
    "camera_samples",
    "light_points",
    "runs",
    "cpu_seconds",
    "cpu_seconds_low",
    "cpu_seconds_high",
    "prepare_seconds",
    "rays",
    "rmse_255",
    "rmse_255_low",
    "rmse_255_high",
    "reference_rmse_255",
    "edges_rmse_255",
    "smooth_rmse_255",
    "hot",
    "front",
)


def answered(document: Mapping[str, Any]) -> dict[str, Any]:
    """Add sentences about the results: `answers` and `about`."""
    return {**document, "answers": answers.answers(document), "about": answers.about(document)}


def files(study: Study, results: Mapping[str, Any]) -> dict[str, bytes]:
    """All files of a report by their paths: the results, both reports, and the images of `report.md`.

    Parameters
    ----------
    study : Study
        A finished study.
    results : dict
        The results as `answered` returns them.
    """
    blocks = list(_blocks(results, _strips(study, results)))
    title = _title(results)
    texts = {
        "results.json": json.dumps(results, indent=2, ensure_ascii=False, allow_nan=False) + "\n",
        "results.csv": _csv(results),
        "report.html": pages.html(title, blocks),
        "report.md": pages.markdown(blocks),
    }
    return {name: text.encode() for name, text in texts.items()} | _images(blocks)


def _images(blocks: list[Block]) -> dict[str, bytes]:
    found: dict[str, bytes] = {}
    for block in blocks:
        if isinstance(block, Plot):
            found[f"{pages.IMAGES}/{block.name}.svg"] = block.svg.encode()
        if isinstance(block, Strip):
            found |= {f"{pages.IMAGES}/{name}": png for name, png, _ in block.pictures}
    return found


def _csv(document: Mapping[str, Any]) -> str:
    buffer = io.StringIO()
    writer = csv.DictWriter(buffer, CSV_COLUMNS, extrasaction="ignore", lineterminator="\n")
    writer.writeheader()
    for row in document["settings"]:
        flat = {**row, "reference_rmse_255": document["reference"]["rmse_255"]}
        for member in ("cpu_seconds", "rmse_255"):
            value = row[member]
            flat |= {
                member: value["estimate"],
                f"{member}_low": value["low"],
                f"{member}_high": value["high"],
            }
        writer.writerow(flat)
    return buffer.getvalue()


def _title(document: Mapping[str, Any]) -> str:
    return f"What accuracy costs: {document['scene'] or 'a scene without a name'}"


def _blocks(document: Mapping[str, Any], strips: list[Strip]) -> Iterator[Block]:
    yield Heading(_title(document), 1)
    yield Points([(row["question"], row["answer"]) for row in document["answers"]])
    yield Paragraph(document["about"])
    yield from map(Paragraph, _conditions(document))
    yield from _curves(document)
    yield from _costs(document)
    if strips:
        yield Heading("Pictures at equal time")
        yield from strips
    yield Heading("All settings")
    yield Paragraph(
        "Camera samples x light points of each; settings that another one beats are grey in the page. Hot "
        "pixels are off by more than a tenth of full scale in some channel. Beside edges: pixels whose "
        "neighbours differ by more than a tenth."
    )
    yield tables.settings(document)


def _conditions(document: Mapping[str, Any]) -> Iterator[str]:
    machine, reference = document["machine"], document["reference"]
    yield (
        f"Errors are root mean squares over linear values clipped to 0..1, against a reference of "
        f"{reference['setting']}. Its own error is {error(reference['rmse_255'])}; it is subtracted from all "
        "errors and drawn in all figures. Their intervals are 95 % intervals. Seconds are CPU seconds of one "
        "process that renders one picture at a time: the median of the runs, with the least and the "
        "greatest. Reading the scene and building trees are left out."
    )
    yield (
        f"Measured on {machine['date'][:10]} on one core of {machine['cpu']}, Python {machine['python']}, "
        f"NumPy {machine['numpy']}, Penumbra {machine['penumbra']}."
    )
    if machine["load"] > IDLE_LOAD:
        yield f"The machine was busy (load {machine['load']:g}), so seconds are too long."
    missing = document["runs"]["planned"] - document["runs"]["done"]
    if missing:
        yield f"{missing} of {document['runs']['planned']} runs did not fit the budget; run it again."
    yield from document["notes"]


def _curves(document: Mapping[str, Any]) -> Iterator[Block]:
    yield Heading("Error against seconds")
    yield Plot(
        "seconds",
        figures.error_against(document, seconds, "seconds"),
        "A line connects the best settings of each method; its other settings are faint.",
    )
    yield Paragraph("CPU seconds to the same error, on these lines, also relative to the fastest method:")
    yield tables.equal_error(document)
    yield Heading("What half the error costs")
    yield Paragraph(
        "The error falls like a power of the cost. This order is fitted to the best settings of each method."
    )
    yield tables.methods(document)
    yield Heading("Work against error")
    yield Plot("rays", figures.error_against(document, rays, "rays"), "Rays do not depend on the machine.")
    yield Heading("Settings worth their time")
    yield Plot(
        "front",
        figures.front(document),
        "Settings with a smaller error than all cheaper ones; others are grey.",
    )
    yield tables.front(document)
    if document["area_lights"]:
        yield Heading("Light points and soft shadows")
        caption = f"With {LIGHT_PLOT_SAMPLES} camera samples, without pixels beside edges."
        yield Plot("light", figures.light_points(document, LIGHT_PLOT_SAMPLES), caption)


def _costs(document: Mapping[str, Any]) -> Iterator[Block]:
    if document["effects"]:
        yield Heading("What effects cost")
        yield Paragraph(
            "Each effect is left out once: the seconds that this saves, and the change of the picture. "
            "Below 0 the effect saves more work than it causes. Rendered with the scene's own patterns and "
            "at most 16 samples of each kind."
        )
        yield tables.effects(document)
    if document["precision"]:
        yield Heading("What double precision costs")
        yield tables.precision(document)


def _strips(study: Study, document: Mapping[str, Any]) -> list[Strip]:
    rows = document["pictures"]
    if not rows:
        return []
    images = [study.picture(row["key"]) for row in rows]
    shown = figures.views(images, study.reference, study.program.scene.document.display)
    names = [*(file_names(row["method"]) for row in rows), file_names("reference")]
    lines = [
        f"{row['name']}: {duration(row['cpu_seconds']['estimate'])}, RMSE x 255 {interval(row['rmse_255'])}, "
        f"hot pixels {100 * row['hot']:.2f} %"
        for row in rows
    ] + ["the reference"]
    captions = {
        "whole": "As displayed.",
        "difference": f"The difference from the reference, {DIFFERENCE_GAIN} times enlarged around grey.",
        "detail": "The part with the largest errors, magnified.",
    }
    return [
        Strip(
            caption,
            [
                (name[view], pictures[view], text)
                for name, pictures, text in zip(names, shown, lines, strict=True)
                if view != "difference" or text != lines[-1]
            ],
        )
        for view, caption in captions.items()
    ]
