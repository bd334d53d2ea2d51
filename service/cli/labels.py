"""``--label``: words of one's own by which jobs are found again."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Annotated

import typer

from service.cli.errors import CommandError

LabelOption = Annotated[
    list[str] | None,
    typer.Option("--label", metavar="NAME:VALUE", help="A label of the job; may be given several times."),
]


def parsed(given: Sequence[str] | None) -> dict[str, str]:
    """Names and values of the options; CommandError where one of them has no colon.

    >>> parsed(["course:cs171", "at:12:30"])
    {'course': 'cs171', 'at': '12:30'}
    """
    pairs = [text.partition(":") for text in given or ()]
    for name, colon, value in pairs:
        if not (name and colon):
            raise CommandError(f"--label {name}{colon}{value} has no name. Write it like course:cs171.")
    return {name: value for name, _, value in pairs}
