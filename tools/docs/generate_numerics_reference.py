"""Write docs/reference/numerics.md from the hard cases.

``python tools/docs/generate_numerics_reference.py`` tries every case, which takes up to a minute, and keeps
the counts in docs/figures/hard_cases.json. The page is made from an introduction, the texts of the cases in
tools/docs/numerics_cases.toml, these counts, and what
``python -m benchmarks stability --runs 9 --out docs/figures/stability.json`` has measured.
"""

from __future__ import annotations

import json
import re
import tomllib
from pathlib import Path
from typing import TYPE_CHECKING, Any

from accuracy.hard_cases import sections
from service.cli import trials

if TYPE_CHECKING:
    from collections.abc import Iterator

    from accuracy.hard_cases import Case, Outcome

ROOT = Path(__file__).parents[2]
PAGE = ROOT / "docs" / "reference" / "numerics.md"
COUNTS = ROOT / "docs" / "figures" / "hard_cases.json"
COSTS = COUNTS.with_name("stability.json")
INTRODUCTION = Path(__file__).with_name("numerics_introduction.txt")
COSTS_TEXT = Path(__file__).with_name("numerics_costs.txt")
CASES = Path(__file__).with_name("numerics_cases.toml")
SCENES = ROOT / "scenes" / "hard"

Counts = dict[str, dict[str, dict[str, Any]]]
"""Tried, wrong, textbook and textbook_single of each case, by section and name."""

WAYS = ("penumbra", "textbook", "factored")
TEXTS = {
    "Symptom": "symptom",
    "Cause": "cause",
    "Remedy": "remedy",
    "Expected": "expected",
    "Source": "source",
}

GEOMETRY = "geometry"
"""Where a remedy comes from that names no source."""

_SCENE_ROW = re.compile(r"\| \[(\w+)\.json\]\([^)]*\) \| (.*?) \| (.*?) \|")
_CODE_OR_SIGN = re.compile(r"(`[^`]*`)|([*<])")


def main() -> None:
    """Try all cases, keep their counts, write the page."""
    counts: Counts = {}
    for trial in trials.one_after_another(sections()):
        if trial.outcome is None:
            raise RuntimeError(f"{trial.section}: {trial.case}: {trial.error}")
        counts.setdefault(trial.section, {})[trial.case] = of_outcome(trial.outcome)
    COUNTS.write_text(json.dumps(counts, indent=1, ensure_ascii=False) + "\n", encoding="utf-8")
    PAGE.write_text(page(), encoding="utf-8")


def of_outcome(outcome: Outcome) -> dict[str, Any]:
    """What of an outcome is the same every time: no seconds."""
    return {name: getattr(outcome, name) for name in ("tried", "wrong", "textbook", "textbook_single")}


def page() -> str:
    """Put the whole page together."""
    counts: Counts = json.loads(COUNTS.read_text(encoding="utf-8"))
    texts = tomllib.loads(CASES.read_text(encoding="utf-8"))
    parts = [INTRODUCTION.read_text(encoding="utf-8"), summary(counts), costs(), *pictures()]
    for section in sections():
        parts.append(f"## {section.title}\n")
        parts += [
            described(case, texts[case.heading], counts[section.title][case.name]) for case in section.cases
        ]
    return "\n".join(parts)


def summary(counts: Counts) -> str:
    """One row a section."""
    rows = [
        "## The count\n",
        "Wrong answers of Penumbra, and of the textbook's formulas to the same questions.\n",
        "| section | cases | answers | wrong here | textbook, float64 | textbook, float32 |",
        "| --- | --- | --- | --- | --- | --- |",
    ]
    for section, cases in counts.items():
        rows.append(row(f"[{section}](#{anchor(section)})", list(cases.values())))
    rows.append(row("all", [case for cases in counts.values() for case in cases.values()]))
    return "\n".join(rows) + "\n"


def row(title: str, cases: list[dict[str, Any]]) -> str:
    """The sums over some cases."""
    sums = (
        sum(case[name] or 0 for case in cases) for name in ("tried", "wrong", "textbook", "textbook_single")
    )
    return f"| {title} | {len(cases)} | " + " | ".join(f"{total:,}" for total in sums) + " |"


def anchor(title: str) -> str:
    """The fragment that a heading is reached by."""
    return re.sub(r"[^\w -]", "", title).lower().replace(" ", "-")


def costs() -> str:
    """What stability costs in time, and what that buys."""
    measured = json.loads(COSTS.read_text(encoding="utf-8"))
    prices, errors = measured["stability"]["prices"], measured["stability"]["errors"]
    ratios = {way: sorted(ratio(price, way) for price in prices["pictures"]) for way in WAYS[1:]}
    machine = measured["machine"]
    return COSTS_TEXT.read_text(encoding="utf-8").format(
        date=machine["date"][:10],
        cpu=machine["cpu"],
        python=machine["python"],
        numpy=machine["numpy"],
        times={way: f"{values[0]:.2f} to {values[-1]:.2f}" for way, values in ratios.items()},
        kernels=priced(prices["kernels"]),
        pictures=priced(prices["pictures"]),
        errors="\n".join(map(wrong_pixels, errors)),
    )


def ratio(price: dict[str, Any], way: str) -> float:
    """How many times as long Penumbra takes."""
    return float(price["seconds"]["penumbra"] / price["seconds"][way])


def priced(prices: list[dict[str, Any]]) -> str:
    """One row a part: milliseconds, and how many times as long Penumbra takes."""
    rows = []
    for price in prices:
        timed = [way for way in WAYS if price["seconds"][way]]
        times = [f"{1000 * price['seconds'][way]:.0f}" if way in timed else "" for way in WAYS]
        ratios = [f"{ratio(price, way):.2f}" if way in timed else "" for way in WAYS[1:]]
        rows.append(f"| {' | '.join([price['name'], *times, *ratios])} |")
    return "\n".join(rows)


def wrong_pixels(errors: dict[str, Any]) -> str:
    """One row: shares of the pixels that are off, and of those too dark."""
    shares = [errors["off"][way] for way in WAYS] + [errors["dark"]["textbook"]]
    cells = " | ".join(f"{100 * share:.3f} %" for share in shares)
    return f"| {errors['scene']} | {errors['offset']:,.0f} | {cells} |"


def pictures() -> Iterator[str]:
    """Show the hard scenes, each with what to notice."""
    yield "## What it looks like\n"
    yield (
        "These scenes are in [scenes/hard](../../scenes/hard/README.md); `make gallery` renders the "
        "pictures. They look like\nordinary scenes here; the last sentence says what a renderer without the "
        "remedies shows.\n"
    )
    for name, notice, wrong in _SCENE_ROW.findall((SCENES / "README.md").read_text(encoding="utf-8")):
        yield f"### {name}\n\n![{name}](../images/hard/{name}.png)\n"
        yield f"{notice} Where it goes wrong: {lowered(wrong)}\n"


def lowered(sentence: str) -> str:
    """With a small first letter."""
    return sentence[0].lower() + sentence[1:]


def described(case: Case, texts: dict[str, str], counts: dict[str, Any]) -> str:
    """All that is known about a case."""
    lines = [f"### {', '.join(case.ids)}: {marked(capitalised(case.name))}\n"]
    lines += [f"- **{title}:** {marked(texts.get(field, GEOMETRY))}" for title, field in TEXTS.items()]
    return "\n".join([*lines, f"- **Tried:** {counted(counts)}", ""])


def capitalised(name: str) -> str:
    """With a large first letter, and the others as they are."""
    return name[0].upper() + name[1:]


def marked(text: str) -> str:
    """Text as Markdown shows it literally, but for its code."""
    return _CODE_OR_SIGN.sub(lambda found: found[1] or f"\\{found[2]}", text)


def counted(counts: dict[str, Any]) -> str:
    """The counts of one case in a sentence."""
    here = f"{counts['tried']:,} answers, {counts['wrong'] or 'none'} wrong."
    plain = [(counts["textbook"], "float64"), (counts["textbook_single"], "float32")]
    asked = [f"{count:,} in {arithmetic}" for count, arithmetic in plain if count is not None]
    return (
        f"{here} The textbook gets {' and '.join(asked)} wrong."
        if asked
        else f"{here} The textbook formula is not tried."
    )


if __name__ == "__main__":
    main()
