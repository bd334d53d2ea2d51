"""The page at `/docs`: all calls and their objects as HTML, without scripts."""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator, Sequence
from html import escape
from itertools import groupby

from service.api.reference import (
    LEAF,
    TITLES,
    Call,
    Member,
    Object,
    Reply,
    Schema,
    anchor,
    calls_of,
    objects_of,
    shared_replies,
)

_HEAD = """<!doctype html>
<html lang="en">
  <head>
    <meta charset="utf-8" />
    <meta name="viewport" content="width=device-width, initial-scale=1" />
    <meta name="color-scheme" content="light dark" />
    <title>HTTP reference: Penumbra</title>
    <link rel="icon" href="/web/icon.svg" type="image/svg+xml" />
    <link rel="stylesheet" href="/web/style.css" />
    <link rel="stylesheet" href="/web/docs.css" />
  </head>
  <body>
    <a class="skip" href="#main">Skip to the content</a>
    <header class="top">
      <a class="brand" href="/">Penumbra</a>
      <nav aria-label="Pages">
        <a href="/">Start</a>
        <a href="/jobs">Jobs</a>
      </nav>
    </header>
    <main id="main" class="reference">
      <h1>HTTP reference</h1>
      <p class="lead">
        Every call of this service. For programs, there are <a href="/openapi.json">/openapi.json</a> and the
        <a href="/v1/schemas/scene.json">JSON Schema of scenes</a>.
      </p>
"""
_EVERY_CALL = """<h2 id="every-call">Every call</h2>
<p>Parameters in a path are required, all others are optional. <code>{job_id}</code> in a path is the id of a
job. Errors are problem documents (RFC 9457); their <code>code</code> is for programs. Besides its own errors,
each call that needs a key may be answered:</p>
"""
_OBJECTS = """<h2 id="objects">Objects</h2>
<p>Objects that requests contain have a column <em>default</em>: a <em>required</em> field must be sent, an
<em>optional</em> one may be left out. Responses have all fields, except that problem documents leave out
those that are null.</p>
"""
_FOOT = "    </main>\n  </body>\n</html>\n"
_LINK = re.compile(r"\[([^]]+)\]\(([^)\s]+)\)")
_CODE = re.compile(r"`([^`]+)`")


def page_of(document: Schema) -> str:
    """Write the page of an OpenAPI document."""
    calls = calls_of(document)
    return "".join(
        [
            _HEAD,
            *_contents(calls),
            _EVERY_CALL,
            _replies(shared_replies(document)),
            *_sections(calls),
            _OBJECTS,
            *(part for found in objects_of(document) for part in _object(found)),
            _FOOT,
        ]
    )


def _contents(calls: Sequence[Call]) -> Iterator[str]:
    yield '<nav class="contents" aria-label="Calls">'
    for tag, group in groupby(calls, key=lambda call: call.tag):
        yield f"<h2>{escape(TITLES[tag])}</h2><ul>"
        for call in group:
            yield f'<li><a href="#{anchor(call.name)}"><code>{escape(call.title)}</code></a> {call.name}</li>'
        yield "</ul>"
    yield "</nav>"


def _sections(calls: Sequence[Call]) -> Iterator[str]:
    for tag, group in groupby(calls, key=lambda call: call.tag):
        yield f'<h2 id="{tag}">{escape(TITLES[tag])}</h2>'
        for call in group:
            yield from _call(call)


def _call(call: Call) -> Iterator[str]:
    yield f'<section><h3 id="{anchor(call.name)}">{escape(call.name)}</h3>'
    yield f'<p class="call"><code>{escape(call.title)}</code></p>'
    yield _blocks(call.text)
    if not call.needs_key:
        yield "<p>It needs no key.</p>"
    if own := call.own_parameters:
        rows = ([_code(one.name), one.place, _inline(one.kind), _meaning(one)] for one in own)
        yield _table(("parameter", "in", "type", "meaning"), rows)
    if call.body:
        yield f"<p>Body: {_inline(call.body)}</p>"
    yield _replies(call.replies)
    yield "</section>"


def _replies(replies: Iterable[Reply]) -> str:
    rows = (
        [str(one.status), _inline(one.text), _inline(", ".join(one.kinds)), " ".join(map(_code, one.codes))]
        for one in replies
    )
    return _table(("status", "when", "body", "code"), rows)


def _object(found: Object) -> Iterator[str]:
    yield f'<section><h3 id="{anchor(found.name)}">{escape(found.name)}</h3>{_blocks(found.text)}'
    header, *rows = found.table()
    yield _table(header, ([_inline(cell) for cell in row] for row in rows))
    yield "</section>"


def _meaning(member: Member) -> str:
    shown = member.shown_default
    return _inline(member.text) + (f" Default: {_code(shown)}." if shown else "")


def _table(header: Sequence[str], rows: Iterable[Sequence[str]]) -> str:
    head = "".join(f'<th scope="col">{name}</th>' for name in header)
    body = "".join(f"<tr>{''.join(f'<td>{cell}</td>' for cell in row)}</tr>" for row in rows)
    return f'<table class="{header[0]}"><thead><tr>{head}</tr></thead><tbody>{body}</tbody></table>'


def _blocks(text: str) -> str:
    """Translate paragraphs and tables of Markdown."""
    return "".join(
        _markdown_table(block.splitlines()) if block.startswith("|") else f"<p>{_inline(block)}</p>"
        for block in text.split("\n\n")
    )


def _markdown_table(lines: Sequence[str]) -> str:
    header, *rows = ([cell.strip() for cell in line.strip("|").split("|")] for line in lines)
    return _table(header, ([_inline(cell) for cell in row] for row in rows if not _is_rule(row)))


def _is_rule(cells: Sequence[str]) -> bool:
    return not "".join(cells).strip("-")


def _inline(text: str) -> str:
    """Translate code and links of Markdown; everything else is text.

    >>> _inline("`a < b` of a [Job](#job)")
    '<code>a &lt; b</code> of a <a href="#job">Job</a>'
    """
    linked = _LINK.sub(r'<a href="\2">\1</a>', escape(text, quote=False))
    return _CODE.sub(r"<code>\1</code>", linked).replace(f"#{anchor(LEAF)}", "/v1/schemas/scene.json")


def _code(text: str) -> str:
    return f"<code>{escape(text)}</code>"
