"""Write docs/reference/http-calls.md from the OpenAPI document of the service and recorded examples."""

from __future__ import annotations

from itertools import groupby
from pathlib import Path
from typing import TYPE_CHECKING, Any

from service.api.reference import (
    LEAF,
    TITLES,
    Call,
    Member,
    Object,
    Reply,
    anchor,
    calls_of,
    objects_of,
    shared_replies,
)
from service.app import create_app
from service.settings import Settings
from tools.docs import http_examples
from tools.docs.templates import filled, table

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator, Sequence

PAGE = Path(__file__).parents[2] / "docs" / "reference" / "http-calls.md"
TEMPLATE = Path(__file__).with_name("http_calls_template.txt")
SEVERAL = 10
"""Fields of a response that is not shown a second time with the same values."""


def page() -> str:
    """Build the page."""
    document = create_app(Settings()).openapi()
    calls = in_order(calls_of(document))
    parts = {
        "setup": http_examples.EXAMPLES["setup"].strip(),
        "contents": contents(calls),
        "shared": replies(shared_replies(document)),
        "calls": "\n\n".join(sections(calls, http_examples.kept())),
        "objects": "\n\n".join(described(found) for found in objects_of(document)),
    }
    return filled(TEMPLATE, parts.__getitem__).replace(f"(#{anchor(LEAF)})", "(scenes.md)")


def in_order(calls: Sequence[Call]) -> list[Call]:
    """Sort calls like their examples, which build on each other."""
    order = [example["call"] for example in http_examples.EXAMPLES["example"]]
    return sorted(calls, key=lambda call: order.index(call.title))


def contents(calls: Sequence[Call]) -> str:
    """List all calls, with links to their sections."""
    rows = ([f"[`{call.title}`](#{anchor(call.name)})", f"{call.name}"] for call in calls)
    return table(("call", "purpose"), rows)


def sections(calls: Sequence[Call], kept: dict[str, Any]) -> Iterator[str]:
    """The section of each tag, with its calls."""
    earlier: dict[tuple[str, ...], list[str]] = {}
    for tag, group in groupby(calls, key=lambda call: call.tag):
        yield f"## {TITLES[tag]}"
        for call in group:
            answer = kept[call.title]
            yield section(call, answer | {"body": unlike(answer["body"], earlier)})


def unlike(body: list[str], earlier: dict[tuple[str, ...], list[str]]) -> list[str]:
    """Leave out what an earlier response with the same fields has shown."""
    names = tuple(line.split('"')[1] for line in body[1:-1] if line.startswith('  "'))
    first = earlier.setdefault(names, body)
    if first is body or len(names) < SEVERAL:
        return body
    return ["{", *(line for line in body[1:-1] if line not in first), "  …", "}"]


def section(call: Call, answer: dict[str, Any]) -> str:
    """Everything about one call."""
    parts = [f"### {call.name}", f"**`{call.title}`**", call.text]
    if not call.needs_key:
        parts.append("It needs no key.")
    if own := call.own_parameters:
        rows = ([f"`{one.name}`", one.place, one.kind, meaning(one)] for one in own)
        parts.append(table(("parameter", "in", "type", "meaning"), rows))
    if call.body:
        parts.append(f"Body: {call.body}")
    parts += [replies(call.replies), example(call, answer)]
    return "\n\n".join(parts)


def replies(found: Iterable[Reply]) -> str:
    """Responses, by status."""
    rows = (
        [str(one.status), one.text, ", ".join(one.kinds), ", ".join(f"`{code}`" for code in one.codes)]
        for one in found
    )
    return table(("status", "when", "body", "code"), rows)


def example(call: Call, answer: dict[str, Any]) -> str:
    """The commands of a call, and what they print."""
    [run] = [one["run"].strip() for one in http_examples.EXAMPLES["example"] if one["call"] == call.title]
    headers = [f"{name}: {value}" for name, value in answer["headers"].items()]
    body = ["", *answer["body"]] if answer["body"] else []
    printed = "\n".join([answer["status"], *headers, *body])
    return f"```sh\n{run}\n```\n\n```http\n{printed}\n```"


def described(found: Object) -> str:
    """The fields of an object."""
    header, *rows = found.table()
    return "\n\n".join([f"### {found.name}", found.text, table(header, rows)])


def meaning(member: Member) -> str:
    """The text of a parameter, with its default if that says something."""
    shown = member.shown_default
    return f"{member.text} Default: `{shown}`.".strip() if shown else member.text
