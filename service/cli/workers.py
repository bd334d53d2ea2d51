"""The option ``--workers``, the same for every command that starts processes."""

from __future__ import annotations

from typing import Annotated

import typer

# Written down twice so that help need not load the settings; a test compares the two.
MOST_WORKERS = 1024

WorkersOption = Annotated[
    int | None,
    typer.Option(min=1, max=MOST_WORKERS, help="Worker processes; by default one for each processor."),
]
