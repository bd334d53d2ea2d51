"""The option ``--layers``, the same for every command that takes it, and the files that layers become."""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from service.cli import output
from service.cli.errors import CommandError
from service.cli.targets import check_target, write_whole

if TYPE_CHECKING:
    from schemas.layers import LayerName

LayersOption = Annotated[
    str | None,
    typer.Option(
        "--layers",
        metavar="NAME,NAME",
        help="What to tell about each pixel beside its colour: depth, position, normal, shading_normal, "
        "albedo, uv, shape, primitive, samples, error. Saved beside OUT as OUT.NAME.npy.",
    ),
]


def parsed(names: str | None) -> tuple[LayerName, ...]:
    """The layers that an option names, each once.

    Raises
    ------
    CommandError
        There is no such layer; the message says which one was probably meant.
    """
    from schemas.layers import checked_layers

    asked = [] if names is None else [name.strip() for name in names.split(",")]
    try:
        return checked_layers(asked)
    except ValueError as error:
        raise CommandError(f"--layers: {error}") from error


def file_of(out: Path, name: str) -> Path:
    """Where a layer goes: beside the picture, named after it."""
    return out.with_name(f"{out.name}.{name}.npy")


def check_targets(out: Path, names: Iterable[str]) -> None:
    """Find out before the work begins whether the files of layers can be written.

    Raises
    ------
    CommandError
        One of them cannot.
    """
    for name in names:
        check_target(file_of(out, name), (".npy",))


def save(out: Path, name: str, content: bytes) -> None:
    """Write the file of a layer, and say where it is."""
    write_whole(file_of(out, name), content)
    output.say(f"{file_of(out, name)}: {name}")
