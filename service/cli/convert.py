"""``penumbra convert``: a scene from another program's file, and what had to be assumed."""

from __future__ import annotations

import json
import textwrap
from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from service.cli import output, scene_files
from service.cli.errors import InputError, UnusableSceneError
from service.cli.options import JsonOption
from service.cli.targets import check_target, write_whole

if TYPE_CHECKING:
    from service.converting.task import Assumption, Conversion

COLUMNS = 80


def convert(
    source: Annotated[
        Path,
        typer.Argument(
            metavar="INPUT", help="A CS171 scene (JSON), OBJ, PLY, glTF or GLB.", show_default=False
        ),
    ],
    out: Annotated[
        Path,
        typer.Option("-o", "--out", help="The scene to write, .json; its meshes and pictures go beside it."),
    ],
    root: Annotated[
        Path | None,
        typer.Option(
            help="Folder that contains the files INPUT refers to; by default that of INPUT.",
            show_default=False,
        ),
    ] = None,
    as_json: JsonOption = False,
) -> None:
    """Convert a file of another program to a scene.

    Reports what was assumed or left out.
    """
    check_target(out, (".json",))
    conversion = _converted(source, root or source.parent, out.parent)
    text = (_written(conversion.document) + "\n").encode()
    for name, content in conversion.files.items():
        write_whole(out.parent / name, content)
    write_whole(out, text)
    if as_json:
        output.document(_as_document(conversion, out))
    else:
        for line in _lines(conversion, out):
            output.say(line)
    _print_warnings(out, text)


def _converted(source: Path, root: Path, folder: Path) -> Conversion:
    from service.converting.errors import ConversionError
    from service.converting.formats import convert as convert_file

    try:
        return convert_file(source, root=root, folder=folder)
    except OSError as error:
        raise InputError(f"{source} cannot be read: {error.strerror or error}.") from error
    except ConversionError as error:
        raise UnusableSceneError(error.name, error.text, error.problems, error.more) from error


def _written(value: object, indent: str = "") -> str:
    """Readable JSON: objects on several lines, lists of numbers on one."""
    inner = indent + "  "
    if isinstance(value, dict) and value:
        lines = [
            f"{inner}{json.dumps(key, ensure_ascii=False)}: {_written(value[key], inner)}" for key in value
        ]
        return "{\n" + ",\n".join(lines) + f"\n{indent}}}"
    if isinstance(value, list) and any(isinstance(item, dict) for item in value):
        lines = [inner + _written(item, inner) for item in value]
        return "[\n" + ",\n".join(lines) + f"\n{indent}]"
    return json.dumps(value, ensure_ascii=False)


def _print_warnings(out: Path, text: bytes) -> None:
    from schemas.reading import read_scene

    warnings = read_scene(text)[1]
    if warnings:
        output.say(f"About {out}:")
        scene_files.print_warnings(text, warnings)


def _as_document(conversion: Conversion, out: Path) -> dict[str, Any]:
    return {
        "out": str(out),
        "format": conversion.kind,
        "scene": conversion.document,
        "assumptions": [assumption.as_document() for assumption in conversion.assumptions],
        "files": sorted(conversion.files),
    }


def _lines(conversion: Conversion, out: Path) -> Iterator[str]:
    from service.converting.task import grouped

    for assumption, others in grouped(conversion.assumptions):
        yield f"  {_kind(assumption)} {_place(assumption, others)}"
        yield textwrap.fill(
            output.harmless(assumption.detail), COLUMNS, initial_indent=" " * 4, subsequent_indent=" " * 4
        )
    counts = ", ".join(
        _counted(len(conversion.document.get(part, ())), part) for part in ("shapes", "materials", "lights")
    )
    yield f"{output.emphasis(str(out))}: {conversion.kind}, {counts}"
    if conversion.files:
        yield f"Beside it: {', '.join(sorted(conversion.files))}"


def _kind(assumption: Assumption) -> str:
    word, color = ("assumed", "yellow") if assumption.kind == "assumed" else ("left out", "red")
    return output.emphasis(word, color)


def _place(assumption: Assumption, others: int) -> str:
    line = f" line {assumption.line}" if assumption.line else ""
    place = f": {output.harmless(assumption.place)}" if assumption.place else ""
    more = f", and {others} more" if others else ""
    return f"{output.harmless(assumption.file)}{line}{place}{more}"


def _counted(count: int, things: str) -> str:
    return f"{count} {things if count != 1 else things.removesuffix('s')}"
