"""The pages that ``--help`` prints."""

from __future__ import annotations

from typing import Any

from typer.core import TyperCommand, TyperGroup


class _WithoutTypesOfFlags:
    """Help that shows no type for flags: Typer's ``--json <bool>`` reads as if a value had to follow."""

    def format_help(self, ctx: Any, formatter: Any) -> None:
        """Write the page."""
        for option in self.get_params(ctx):  # type: ignore[attr-defined]
            if getattr(option, "is_flag", False):
                option.metavar = ""
        super().format_help(ctx, formatter)  # type: ignore[misc]


class Command(_WithoutTypesOfFlags, TyperCommand):
    """A command."""


class Group(_WithoutTypesOfFlags, TyperGroup):
    """A command that has others."""
