"""MkDocs hook: navigation from docs/README.md, links and lists as a forge reads them, tables of fields."""

from __future__ import annotations

import json
import logging
import os
import re
from pathlib import Path, PurePosixPath
from typing import Any

from markdown_it import MarkdownIt
from mkdocs.structure.files import File

from schemas.grading.manifest_reading import manifest_json_schema
from schemas.grading.manifests import Criterion
from schemas.json_schema import scene_json_schema

ROOT = Path(__file__).parents[1]
INDEX = PurePosixPath("docs/README.md")
ICON = ROOT / "service" / "web" / "icon.svg"
SECTION = re.compile(r"^## (?:[^:\n]+: )?(.+)$", re.MULTILINE)
ENTRY = re.compile(r"^- \[([^]]+)\]\(([^)\s]+)\)", re.MULTILINE)
FENCE_OR_LINK = re.compile(r"(?ms)^```.*?^```|(?P<text>!?\[[^]]*\])\((?P<link>[^)\s]+)\)")
FIELDS = re.compile(r"^Fields: `(\w+)`\.$", re.MULTILINE)
MARKER = re.compile(r" *((?:[-*+]|\d+[.)]) +)")
CELL = re.compile(r"<t[dh]\b.*?</t[dh]>", re.DOTALL)
BAR, ESCAPED = re.compile(r"(?<!\\)[|]"), r"\\|"
FORGE = MarkdownIt("commonmark").enable("table")

log = logging.getLogger("mkdocs.hooks.site")


def on_config(config: Any) -> None:
    """Take the navigation from the index: a section for each heading, then pages outside docs."""
    index = (ROOT / INDEX).read_text()
    _, *parts = SECTION.split(index)
    sections: list[dict[str, Any]] = [{"Documentation": in_site(INDEX)}]
    for title, body in zip(parts[::2], parts[1::2], strict=True):
        entries = [{text: in_site(in_repository(INDEX, link))} for text, link in ENTRY.findall(body)]
        sections.append({title.capitalize(): entries})
    listed = {in_site(in_repository(INDEX, link)) for _, link in ENTRY.findall(index)}
    others = [path for path in map(in_site, outside_pages()) if path not in listed]
    config.nav = [*sections, {"Project": others}]


def on_files(files: Any, config: Any) -> None:
    """Add the pages outside docs that the index links to, and the icon of the service."""
    for path in outside_pages():
        files.append(File.generated(config, in_site(path), abs_src_path=str(ROOT / path)))
    files.append(File.generated(config, ICON.name, abs_src_path=str(ICON)))


def on_page_markdown(markdown: str, *, page: Any, **_: object) -> str:
    """Insert tables of fields, lead links to pages of the site, and write lists as MkDocs reads them."""
    here = PurePosixPath(Path(str(page.file.abs_src_path)).relative_to(ROOT))
    with_tables = FIELDS.sub(lambda found: table_of_fields(found[1]), markdown)
    return with_wide_lists(relinked(with_tables, here))


def on_page_content(html: str, **_: object) -> str:
    """Show | in the code of a table without the backslash that it needs there."""
    return CELL.sub(lambda cell: cell.group().replace("\\|", "|"), html)


def outside_pages() -> list[PurePosixPath]:
    """Pages outside docs that the index links to, in their order."""
    links = [match["link"] or ":" for match in FENCE_OR_LINK.finditer((ROOT / INDEX).read_text())]
    paths = dict.fromkeys(in_repository(INDEX, link) for link in links if ":" not in link)
    return [path for path in paths if path.suffix == ".md" and path.parts[0] not in ("docs", "README.md")]


def in_repository(here: PurePosixPath, link: str) -> PurePosixPath:
    """Target of a file's relative link, from the root of the repository."""
    return PurePosixPath(os.path.normpath(here.parent / link.partition("#")[0]))


def in_site(path: PurePosixPath) -> str:
    """Path of a repository's file in the site: docs is the root, other folders are below it."""
    return str(path.relative_to("docs") if path.is_relative_to("docs") else path)


def relinked(markdown: str, here: PurePosixPath) -> str:
    """A page whose links stay inside the site; a link to any other file becomes its name."""

    def change(match: re.Match[str]) -> str:
        text, link = match["text"], match["link"]
        if link is None or link.startswith("#") or re.match(r"[a-z]+:", link):
            return match.group()
        path = in_repository(here, link)
        if path.is_relative_to("docs") or path in outside_pages():
            there = os.path.relpath(in_site(path), PurePosixPath(in_site(here)).parent)
            return f"{text}({there}{link[len(link.partition('#')[0]) :]})"
        if text.startswith("!") or not (ROOT / path).exists():
            log.warning("%s: %s is not there, or a picture outside docs", here, link)
        return f"`{path}`" if text.strip("[`]") in str(path) else f"{text[1:-1]} (`{path}`)"

    return FENCE_OR_LINK.sub(change, markdown)


def with_wide_lists(markdown: str) -> str:
    """A page with lists as only MkDocs needs them: indented by four, with empty lines around them."""
    lines = markdown.split("\n")
    for token in FORGE.parse(markdown):
        first, last = token.map or (0, 0)
        if token.type == "list_item_open" and (marker := MARKER.match(lines[first])):
            missing = " " * (4 - len(marker[1]))
            for i in range(first + 1, last):
                lines[i] = missing + lines[i] if lines[i].strip() else lines[i]
            if "" in lines[first:last]:
                lines[last - 1] = lines[last - 1].rstrip("\n") + "\n"
        elif token.type.endswith("list_open") and token.level == 0 and first and lines[first - 1].strip():
            lines[first - 1] += "\n"
    return "\n".join(lines)


def table_of_fields(name: str) -> str:
    """A row for each field of a class of the scene language or of manifests."""
    scenes, manifests = scene_json_schema(), manifest_json_schema()
    whole = scenes if name == "Scene" or name in scenes["$defs"] else manifests
    models = {"Scene": whole, "Manifest": whole, "Criterion": Criterion.model_json_schema(), **whole["$defs"]}
    own = models[name]
    shared = Criterion.model_fields.keys() if "kind" in own["properties"] else ()
    rows = ["| field | type | default | meaning |", "| --- | --- | --- | --- |"]
    for field, value in own["properties"].items():
        if field not in shared:
            default = "required" if field in own.get("required", ()) else value.get("default")
            shown = f"`{json.dumps(default)}`" if default not in (None, "required") else default or ""
            cells = (f"`{field}`", kind(value, whole), shown, value.get("description", "The kind."))
            rows.append(f"| {' | '.join(BAR.sub(ESCAPED, cell) for cell in cells)} |")
    return "\n".join(rows)


def kind(value: dict[str, Any], whole: dict[str, Any]) -> str:
    """The type of a value, in words."""
    if options := value.get("anyOf") or value.get("oneOf"):
        return " or ".join(dict.fromkeys(kind(one, whole) for one in options if one != {"type": "null"}))
    if reference := value.get("$ref"):
        name = reference.rpartition("/")[2]
        tag = whole["$defs"][name]["properties"].get("type", {}).get("const")
        return f"`{tag}`" if tag else f"{name} object"
    if "const" in value or "enum" in value:
        return " or ".join(f"`{json.dumps(one)}`" for one in value.get("enum", [value.get("const")]))
    if value["type"] == "array":
        entries, count = kind(value["items"], whole), value.get("minItems")
        if not count or count != value.get("maxItems"):
            return f"array of {entries}"
        return f"{count} x {entries}" if entries[0].isdigit() else f"{count} {entries}s"
    if value["type"] == "object" and "additionalProperties" in value:
        return f"object of names, each with {kind(value['additionalProperties'], whole)}"
    return {"integer": "whole number", "string": "text"}.get(value["type"], str(value["type"]))
