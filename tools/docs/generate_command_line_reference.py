"""Write docs/reference/command-line.md from the commands, their options and help texts."""

from __future__ import annotations

import inspect
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Literal, NamedTuple, get_args, get_origin

from typer.models import ArgumentInfo, OptionInfo

from service.cli import keys, render
from service.cli.commands import COMMANDS
from service.cli.options import JsonOption, ServerOption
from service.cli.quality_options import PANEL
from tools.docs.templates import filled, table

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Iterator

PAGE = Path(__file__).parents[2] / "docs" / "reference" / "command-line.md"
TEMPLATE = Path(__file__).with_name("command_line_template.txt")
COMMON = {get_args(option)[1].help for option in (JsonOption, ServerOption)}
"""Help of options that the template describes once for all commands."""
SELF_EVIDENT = {"job_id", "job_ids"}
"""Arguments that need no table if there is nothing else in it."""
LARGEST = 1e6
"""Bounds beyond this say nothing to a reader."""
TYPES = {"int": "N", "float": "X", "str": "TEXT", "Path": "PATH"}
"""What stands for a value of a type, where the option does not say it."""


class Parameter(NamedTuple):
    """An argument or an option of a command."""

    name: str
    info: ArgumentInfo | OptionInfo
    value: str
    """What stands for its value; empty for a flag."""
    default: Any

    @property
    def is_argument(self) -> bool:
        """Whether it is given by its place."""
        return isinstance(self.info, ArgumentInfo)

    @property
    def is_required(self) -> bool:
        """Whether the command does nothing without it."""
        return self.default is inspect.Parameter.empty

    @property
    def words(self) -> list[str]:
        """Its names, such as -o and --out."""
        # In an annotation, Typer takes the first name for the default.
        decls = (self.info.default, *(self.info.param_decls or ()))
        given = [word for word in decls if isinstance(word, str) and word.startswith("-")]
        return given or [f"--{self.name.replace('_', '-')}"]


def page() -> str:
    """Build the page: each placeholder of the template is a command, or the options of quality."""
    return filled(TEMPLATE, parts().__getitem__)


def parts() -> dict[str, str]:
    """The sections that the template puts in their places, by name."""
    quality = [one for one in parameters(render.render) if one.info.rich_help_panel == PANEL]
    return {"commands": summary(), "quality_options": options(quality)} | {
        name.replace(" ", "_"): section(name, function) for name, function in commands()
    }


def summary() -> str:
    """All commands with the first lines of their help."""
    rows = (
        (f"[`{name}`](#{name.replace(' ', '-')})", (inspect.getdoc(function) or "").partition("\n")[0])
        for name, function in commands()
    )
    return table(("command", "does"), rows)


def commands() -> Iterator[tuple[str, Callable[..., Any]]]:
    """All commands with their functions."""
    yield from ((name, function) for name, _, function in COMMANDS)
    for info in keys.app.registered_commands:
        assert info.callback
        yield f"keys {info.name or info.callback.__name__}", info.callback


def parameters(function: Callable[..., Any]) -> list[Parameter]:
    """The arguments and options of a command, in its order."""
    signature = inspect.signature(function, eval_str=True)
    return [
        described(one) for one in signature.parameters.values() if get_origin(one.annotation) is Annotated
    ]


def described(parameter: inspect.Parameter) -> Parameter:
    """One of them."""
    kind, info = get_args(parameter.annotation)[:2]
    return Parameter(parameter.name, info, info.metavar or value_of(kind), parameter.default)


def value_of(kind: Any) -> str:
    """What stands for a value of a type: its choices, or a letter."""
    kinds = (
        [part for part in get_args(kind) if part is not type(None)] if get_origin(kind) is not Literal else []
    )
    if len(kinds) == 1 or get_origin(kind) is list:
        return value_of(kinds[0])
    if get_origin(kind) is Literal:
        return "|".join(get_args(kind))
    if kind is bool:
        return ""
    return "|".join(kind) if hasattr(kind, "__members__") else TYPES[kind.__name__]


def section(name: str, function: Callable[..., Any]) -> str:
    """A command: how it is called, what it does, and its options."""
    found = parameters(function)
    own = [one for one in found if one.info.rich_help_panel != PANEL and one.info.help not in COMMON]
    text = [f"### {name}", f"**`{usage(name, found)}`**", inspect.getdoc(function) or ""]
    if any(one.name not in SELF_EVIDENT for one in own):
        text.append(options(own))
    return "\n\n".join(text + list(quality(found)))


def usage(name: str, found: Iterable[Parameter]) -> str:
    """The line that calls a command."""
    words = ["penumbra", name]
    words += [one.info.metavar or one.name.upper() for one in found if one.is_argument]
    words += [f"{one.words[0]} {one.value}" for one in found if not one.is_argument and one.is_required]
    words += ["[OPTIONS]"] if any(not one.is_argument and not one.is_required for one in found) else []
    return " ".join(words)


def quality(found: Iterable[Parameter]) -> Iterator[str]:
    """A link to the options of quality, for a command that has them."""
    names = {one.name for one in found if one.info.rich_help_panel == PANEL}
    if "target_error" in names:
        yield "Also the [quality options](#quality-options)."
    elif names:
        yield "Also the [quality options](#quality-options) for samples: this setting is priced first."


def options(found: Iterable[Parameter]) -> str:
    """A table of arguments and options."""
    return table(("option", "meaning"), ((label(one), meaning(one)) for one in found))


def label(one: Parameter) -> str:
    """The names of an option with its value, or that of an argument."""
    if one.is_argument:
        return f"`{one.info.metavar or one.name.upper()}`"
    *others, last = one.words
    value = f" {one.value}" if one.value else ""
    return ", ".join([*(f"`{word}`" for word in others), f"`{last}{value}`"])


def meaning(one: Parameter) -> str:
    """The help text, with bounds, the default and the environment variable."""
    text = [one.info.help or ""]
    low, high = one.info.min, one.info.max
    if low is not None and (high is None or high <= LARGEST):
        text.append(f"{low:g} to {high:g}." if high is not None else f"At least {low:g}.")
    default = one.info.show_default if isinstance(one.info.show_default, str) else one.default
    if not one.is_required and default not in (None, False):
        text.append(f"Default: `{default}`.")
    if one.info.envvar:
        text.append(f"Or `{one.info.envvar}`.")
    return " ".join(text)
