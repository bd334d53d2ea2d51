"""A progress bar on a terminal, and nothing on a pipe."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from typing import TYPE_CHECKING

from service.cli import output

if TYPE_CHECKING:
    from rich.live import Live
    from rich.progress import Progress, TaskID
    from rich.text import Text


@dataclass(frozen=True, slots=True)
class Bar:
    """A progress bar with text below it; `progress` is None if there is no terminal."""

    progress: Progress | None
    task: TaskID | None
    live: Live | None = None
    text: Text | None = None

    @property
    def visible(self) -> bool:
        """Whether stderr is a terminal."""
        return self.progress is not None

    @property
    def block(self) -> str:
        """The character that bars are made of, one that the terminal can show."""
        return "#" if self.progress is not None and self.progress.console.options.ascii_only else "\u2587"

    def show(self, share: float, note: str = "", *, title: str | None = None) -> None:
        """Show the share that is done, 0 to 1, and a note; `title` replaces the one before."""
        if self.progress is not None and self.task is not None:
            self.progress.update(self.task, completed=share, note=note, description=title)

    def above(self, line: str) -> None:
        """Print a line that stays above the bar."""
        if self.live is not None:
            self.live.console.print(line, highlight=False, markup=False, soft_wrap=True)

    def below(self, text: str) -> None:
        """Replace the text below the bar."""
        if self.text is not None:
            self.text.plain = text


def remaining(seconds: float | None) -> str:
    """The remaining time as the end of a sentence; empty if it is not known.

    Examples
    --------
    >>> remaining(3.7), remaining(250), remaining(None)
    (', about 4 s left', ', about 4 min left', '')
    """
    if seconds is None:
        return ""
    if seconds >= 100:
        return f", about {seconds / 60:.0f} min left"
    return f", about {max(seconds, 1):.0f} s left"


def advancing(bar: Bar, total: int) -> Callable[[str], None]:
    """A function that moves the bar by one step, with a note and an estimate of the time left."""
    begun, done = time.monotonic(), 0

    def advance(note: str) -> None:
        nonlocal done
        done += 1
        left = (time.monotonic() - begun) * (total - done) / done
        bar.show(done / total, output.harmless(note) + remaining(left) if done < total else "")

    return advance


@contextmanager
def progress_bar(title: str) -> Iterator[Bar]:
    """A bar on stderr while the block runs; it stays there afterwards."""
    import sys

    if not sys.stderr.isatty():
        yield Bar(None, None)
        return
    from rich.console import Console, Group
    from rich.live import Live
    from rich.progress import BarColumn, Progress, TextColumn, TimeElapsedColumn
    from rich.text import Text

    columns = (
        TextColumn("{task.description}"),
        BarColumn(bar_width=32),
        TextColumn("{task.percentage:>3.0f} %"),
        TimeElapsedColumn(),
        TextColumn("{task.fields[note]}", style="dim"),
    )
    console = Console(stderr=True)
    progress, text = Progress(*columns, console=console), Text()
    task = progress.add_task(title, total=1.0, note="")

    def shown() -> Group:
        return Group(progress, text) if text.plain else Group(progress)

    with Live(console=console, get_renderable=shown) as live:
        yield Bar(progress, task, live, text)
