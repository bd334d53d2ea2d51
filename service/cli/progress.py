"""A progress bar on a terminal, and nothing on a pipe."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from rich.progress import Progress, TaskID


@dataclass(frozen=True, slots=True)
class Bar:
    """One line that shows how far something is; `progress` is None where nobody looks."""

    progress: Progress | None
    task: TaskID | None

    @property
    def visible(self) -> bool:
        """Whether anybody sees it."""
        return self.progress is not None

    def show(self, share: float, note: str = "", *, title: str | None = None) -> None:
        """Show how much is done, 0 to 1, and a few words about it; `title` replaces the one before."""
        if self.progress is not None and self.task is not None:
            self.progress.update(self.task, completed=share, note=note, description=title)


@contextmanager
def progress_bar(title: str) -> Iterator[Bar]:
    """A bar on stderr while the block runs; afterwards it stays there as it was last."""
    import sys

    if not sys.stderr.isatty():
        yield Bar(None, None)
        return
    from rich.console import Console
    from rich.progress import BarColumn, Progress, TextColumn, TimeElapsedColumn

    columns = (
        TextColumn("{task.description}"),
        BarColumn(bar_width=32),
        TextColumn("{task.percentage:>3.0f} %"),
        TimeElapsedColumn(),
        TextColumn("{task.fields[note]}", style="dim"),
    )
    with Progress(*columns, console=Console(stderr=True)) as progress:
        yield Bar(progress, progress.add_task(title, total=1.0, note=""))
