"""Write every page that is generated, from the kept figures and from the code.

``python -m tools.docs.write_pages`` measures nothing. Where figures are missing it writes nothing, and names
the command that measures them.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

from tools.docs import (
    figures,
    fill_figures,
    generate_accuracy_page,
    generate_assignment_page,
    generate_capacity_page,
    generate_command_line_reference,
    generate_constants_reference,
    generate_costs_page,
    generate_http_reference,
    generate_manifest_reference,
    generate_numerics_reference,
    generate_performance_page,
    generate_reliability_page,
    generate_scene_reference,
)

if TYPE_CHECKING:
    from collections.abc import Callable
    from pathlib import Path


class Page(NamedTuple):
    """A page: where it is, the names of the figures that it is made of, and how."""

    path: Path
    figures: tuple[str, ...]
    of: Callable[..., str]

    def text(self) -> str:
        """Make the page again.

        Raises
        ------
        MissingFiguresError
            If some of its figures are not kept.
        """
        return self.of(*map(figures.read, self.figures))


def _filled(path: Path) -> Page:
    text = path.read_text(encoding="utf-8")
    return Page(path, fill_figures.figures_of(text), lambda *_: fill_figures.filled(text))


def pages() -> list[Page]:
    """Pages of which all is generated, and those by hand that have figures between marks."""
    return [*GENERATED, *map(_filled, fill_figures.pages())]


GENERATED = (
    Page(generate_accuracy_page.PAGE, ("study",), generate_accuracy_page.page),
    Page(generate_assignment_page.PAGE, ("assignment",), generate_assignment_page.page),
    Page(generate_capacity_page.PAGE, ("capacity",), generate_capacity_page.page),
    Page(generate_costs_page.PAGE, ("bench", "jobs", "lists", "page"), generate_costs_page.page),
    Page(generate_performance_page.PAGE, ("peers",), generate_performance_page.page),
    Page(generate_reliability_page.PAGE, ("chaos", "soak", "load"), generate_reliability_page.page),
    Page(generate_command_line_reference.PAGE, (), generate_command_line_reference.page),
    Page(generate_constants_reference.PAGE, (), generate_constants_reference.page),
    Page(generate_http_reference.PAGE, (), generate_http_reference.page),
    Page(generate_manifest_reference.PAGE, (), generate_manifest_reference.page),
    Page(generate_scene_reference.PAGE, (), generate_scene_reference.page),
)


def main() -> None:
    """Write all pages, or none."""
    texts = {page.path: page.text() for page in pages()} | generate_numerics_reference.pages()
    for path, text in texts.items():
        path.write_text(text, encoding="utf-8")


if __name__ == "__main__":
    main()
