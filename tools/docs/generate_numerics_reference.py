"""Write docs/reference/numerics.md, and a page for each section of the hard cases.

``python -m tools.docs.generate_numerics_reference`` tries every case, which takes up to a minute, and keeps
the counts; ``python -m tools.docs.write_pages`` takes the counts that are kept. The texts are in
tools/docs/numerics_*.toml and *.txt.
"""

from __future__ import annotations

import importlib
import inspect
import json
import operator
import re
import tomllib
from pathlib import Path
from typing import TYPE_CHECKING, Any

from accuracy.hard_cases import SECTIONS, sections
from accuracy.hard_cases.harness import DIGITS
from accuracy.hard_cases.oracle import BITS
from benchmarks import stability
from service.cli import trials
from tests.numerics.test_remedies import SWITCHED_OFF
from tools.docs import figures
from tools.docs.templates import table, table_rows

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence

    from accuracy.hard_cases import Case, Outcome, Section

ROOT = Path(__file__).parents[2]
PAGE = ROOT / "docs" / "reference" / "numerics.md"
FOLDER = PAGE.with_suffix("")
COUNTS = figures.FOLDER / "hard_cases.json"
RESULTS_TEXT = Path(__file__).with_name("numerics_results.txt")
COSTS_TEXT = Path(__file__).with_name("numerics_costs.txt")
CASES = Path(__file__).with_name("numerics_cases.toml")
SECTION_TEXTS = Path(__file__).with_name("numerics_sections.toml")
SCENES = ROOT / "scenes" / "hard"

Counts = dict[str, dict[str, dict[str, Any]]]
"""Tried, wrong, textbook and textbook_single of each case, by section and name."""

COUNTED = ("tried", "wrong", "textbook", "textbook_single")
ASKED = ("tried", "textbook", "textbook_single")
CASE_COLUMNS = ("case", "answers", "wrong, float64", "wrong, float32", "fails without")
WAYS = tuple(stability.WAYS)
"""Penumbra, then what it is compared with."""

WRITTEN = """\
<!-- Written by tools/docs/generate_numerics_reference.py from
     tools/docs/numerics_cases.toml and tools/docs/numerics_sections.toml.
     Change those, then run python -m tools.docs.write_pages. -->
"""

READING = """\
Penumbra gets {wrong} of {tried:,} answers wrong. The table counts the textbook's wrong answers, and links
what a case fails without ([how to read it](../numerics.md#what-counts)). The cases are in {modules}.
"""

_SCENE_ROW = re.compile(r"\| \[(\w+)\.json\]\([^)]*\) \| (.*?) \| (.*?) \|")
_CODE_OR_SIGN = re.compile(r"(`[^`]*`)|([*<])")


def main() -> None:
    """Try all cases, keep their counts, and write the pages."""
    COUNTS.write_text(json.dumps(tried(), indent=1, ensure_ascii=False) + "\n", encoding="utf-8")
    for path, text in pages().items():
        path.write_text(text, encoding="utf-8")


def tried() -> Counts:
    """Counts of all cases; an error if one of them broke off."""
    counts: Counts = {}
    for trial in trials.one_after_another(sections()):
        if trial.outcome is None:
            raise RuntimeError(f"{trial.section}: {trial.case}: {trial.error}")
        counts.setdefault(trial.section, {})[trial.case] = of_outcome(trial.outcome)
    return counts


def of_outcome(outcome: Outcome) -> dict[str, Any]:
    """What of an outcome is the same every time: no seconds."""
    return {name: getattr(outcome, name) for name in COUNTED}


def read(path: Path) -> dict[str, Any]:
    """The texts of a file."""
    return tomllib.loads(path.read_text(encoding="utf-8"))


def pages() -> dict[Path, str]:
    """Texts of all pages, by their paths."""
    counts: Counts = figures.read("hard_cases")
    measured = figures.read("stability")
    texts, about = read(CASES), read(SECTION_TEXTS)
    written = {
        PAGE: results(counts, about, ranges(measured["stability"]["prices"])),
        FOLDER / "cost.md": costs(measured),
    }
    for section in sections():
        written[path_of(section.title, about)] = section_page(section, texts, about, counts[section.title])
    return written


def path_of(title: str, about: dict[str, Any]) -> Path:
    """The page of a section."""
    return FOLDER / f"{about[title]['file']}.md"


def results(counts: Counts, about: dict[str, Any], times: dict[str, str]) -> str:
    """The page with one row for each section."""
    rows = [
        (f"[{title}]({FOLDER.name}/{about[title]['file']}.md)", f"{len(cases)}", *sums(list(cases.values())))
        for title, cases in counts.items()
    ]
    every = [case for cases in counts.values() for case in cases.values()]
    rows.append(("all", f"{len(every)}", *sums(every)))
    return RESULTS_TEXT.read_text(encoding="utf-8").format(
        cases=len(every),
        table=table_rows(rows),
        digits=DIGITS,
        bits=BITS,
        times=times,
    )


def sums(cases: Sequence[dict[str, Any]], names: Sequence[str] = COUNTED) -> list[str]:
    """The sums over some cases; empty where no formula was asked."""
    known = [[case[name] for case in cases if case[name] is not None] for name in names]
    return [f"{sum(values):,}" if values else "" for values in known]


def section_page(
    section: Section, texts: dict[str, Any], about: dict[str, Any], counts: dict[str, Any]
) -> str:
    """The page of one section: counts, pictures, cases, sources."""
    said = about[section.title]
    parts = [f"# {section.title}: hard cases\n", WRITTEN]
    parts += [said["introduction"].lstrip(), counted(section, counts), *pictures(said.get("pictures", []))]
    parts += ["## Cases\n", *(described(case, texts[case.heading]) for case in section.cases)]
    parts += cited(about["sources"], [texts[case.heading] for case in section.cases])
    return "\n".join(parts)


def counted(section: Section, counts: dict[str, Any]) -> str:
    """What is tried, and one row a case: how often the textbook is wrong, and what the case fails without."""
    total = {name: sum(case[name] for case in counts.values()) for name in ("tried", "wrong")}
    reading = READING.format(**total, modules=", ".join(map(linked_module, SECTIONS[section.title])))
    rows = (
        (f"[{heading(case)}](#{anchor(heading(case))})", *sums([counts[case.name]], ASKED), held(case))
        for case in section.cases
    )
    return f"{reading}\n{table(CASE_COLUMNS, rows)}\n"


def linked_module(name: str) -> str:
    """A link to a module of hard cases."""
    path = f"accuracy/hard_cases/{name.replace('.', '/')}.py"
    return f"[{name}](../../../{path})"


def heading(case: Case) -> str:
    """The numbers and the name of a case, as its heading."""
    return f"{', '.join(case.ids)}: {case.name[0].upper()}{case.name[1:]}"


def anchor(title: str) -> str:
    """The fragment that a heading is reached by."""
    return re.sub(r"[^\w -]", "", title).lower().replace(" ", "-")


def described(case: Case, texts: dict[str, str]) -> str:
    """What goes wrong and why, what is done about it, and what counts as right."""
    source = f" Source: {texts['source']}." if "source" in texts else ""
    lines = [f"### {heading(case)}\n", marked(f"{texts['symptom']} {texts['cause']}\n")]
    if "example" in texts:
        lines.append(f"```pycon\n{texts['example'].strip()}\n```\n")
    lines.append(f"**Remedy:** {marked(texts['remedy'])}{source}\n")
    lines.append(f"**Right:** {marked(texts['expected'])}\n")
    return "\n".join(lines)


def held(case: Case) -> str:
    """What the case fails without, as tests/numerics/test_remedies.py switches it off."""
    found = dict.fromkeys(filter(None, map(located, SWITCHED_OFF[case.heading])))
    return ", ".join(f"[`{name}`](../../../{path})" for name, path in found)


def located(dotted: str) -> tuple[str, str] | None:
    """Name and file of what is switched off, where it is defined; None for what is none of the renderer's."""
    module, name = split(dotted)
    thing = operator.attrgetter(name)(importlib.import_module(module))
    if inspect.isroutine(thing):
        module, name = thing.__module__, thing.__qualname__
    if module.startswith("accuracy."):
        return None
    path = module.replace(".", "/")
    file = f"{path}.py" if (ROOT / f"{path}.py").is_file() else f"{path}/__init__.py"
    return f"{module.removeprefix('renderer.')}.{name}", file


def split(dotted: str) -> tuple[str, str]:
    """The longest part that is a module, and the rest."""
    parts = dotted.split(".")
    for end in range(len(parts) - 1, 0, -1):
        module = "/".join(parts[:end])
        if (ROOT / f"{module}.py").is_file() or (ROOT / module / "__init__.py").is_file():
            return ".".join(parts[:end]), ".".join(parts[end:])
    raise ValueError(dotted)


def pictures(names: list[str]) -> Iterator[str]:
    """Show some of the hard scenes, each with what plain formulas make of it."""
    rows = _SCENE_ROW.findall((SCENES / "README.md").read_text(encoding="utf-8"))
    artefacts = {name: wrong for name, _, wrong in rows}
    if names:
        yield "## Scenes\n"
    for name in names:
        yield f"![{name}](../../images/hard/{name}.png)\n"
        yield f"[{name}](../../../scenes/hard/{name}.json). Plain formulas: {lowered(artefacts[name])}\n"


def lowered(sentence: str) -> str:
    """With a small first letter."""
    return sentence[0].lower() + sentence[1:]


def cited(sources: dict[str, str], texts: list[dict[str, str]]) -> Iterator[str]:
    """What the short names of papers and books stand for; nothing where no case has one."""
    names = {name for text in texts for name in text.get("source", "").split("; ")} & sources.keys()
    if names:
        yield "## Sources\n"
        yield "\n".join(f"- {name}: {sources[name]}" for name in sorted(names)) + "\n"


def marked(text: str) -> str:
    """Text as Markdown shows it literally, but for its code."""
    return _CODE_OR_SIGN.sub(lambda found: found[1] or f"\\{found[2]}", text.format(digits=DIGITS))


def costs(measured: dict[str, Any]) -> str:
    """What stability costs in time, and what that buys."""
    prices, machine = measured["stability"]["prices"], measured["machine"]
    return COSTS_TEXT.read_text(encoding="utf-8").format(
        date=machine["date"][:10],
        cpu=machine["cpu"],
        python=machine["python"],
        numpy=machine["numpy"],
        times=ranges(prices),
        kernels=table_rows(map(priced, prices["kernels"])),
        pictures=table_rows(map(priced, prices["pictures"])),
        errors=table_rows(map(wrong_pixels, measured["stability"]["errors"])),
    )


def ranges(prices: dict[str, Any]) -> dict[str, str]:
    """How many times as long as with other formulas whole pictures take, from the least to the most."""
    ratios = {way: sorted(ratio(price, way) for price in prices["pictures"]) for way in WAYS[1:]}
    return {way: f"{values[0]:.2f} to {values[-1]:.2f}" for way, values in ratios.items()}


def ratio(price: dict[str, Any], way: str) -> float:
    """How many times as long Penumbra takes."""
    return float(price["seconds"]["penumbra"] / price["seconds"][way])


def priced(price: dict[str, Any]) -> Sequence[str]:
    """Cells of a part: milliseconds, and how many times as long Penumbra takes."""
    timed = [way for way in WAYS if price["seconds"][way]]
    times = [f"{1000 * price['seconds'][way]:.0f}" if way in timed else "" for way in WAYS]
    return price["name"], *times, *(f"{ratio(price, way):.2f}" if way in timed else "" for way in WAYS[1:])


def wrong_pixels(errors: dict[str, Any]) -> Sequence[str]:
    """Cells of a scene: shares of the pixels that are off, and of those too dark."""
    shares = [errors["off"][way] for way in WAYS] + [errors["dark"]["textbook"]]
    return errors["scene"], f"{errors['offset']:,.0f}", *(f"{100 * share:.3f} %" for share in shares)


if __name__ == "__main__":
    main()
