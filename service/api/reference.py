"""All calls and their objects, read from the OpenAPI document: for `/docs` and for the documentation."""

from __future__ import annotations

import json
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

Schema = Mapping[str, Any]

TITLES = {
    "access": "Users",
    "jobs": "Jobs",
    "tiles": "Tiles",
    "pictures": "Pictures",
    "scenes": "Scenes",
    "assets": "Textures and meshes",
    "operations": "Operations",
}
"""Headings of the calls, by their tags."""
METHODS = ("get", "head", "put", "post", "delete")
SHARED_CODES = frozenset({"unauthenticated", "key_expired", "cross_site", "unknown_host", "parameters"})
"""Codes that every call may answer; they are described once."""
PROBLEM = "application/problem+json"
LEAF = "Scene"
"""The scene language has a reference of its own."""

_NO_LIMIT = 2**31 - 1
_SIMPLE = {"integer": "whole number", "number": "number", "boolean": "true or false", "null": "null"}
_FORMATS = {"date-time": "time", "binary": "bytes"}
_SEVERAL = {"number": "numbers", "whole number": "whole numbers", "text": "texts"}


@dataclass(frozen=True, slots=True)
class Member:
    """A parameter of a call, or a field of an object. `kind` and `text` are Markdown of one line."""

    name: str
    kind: str
    text: str
    place: str = ""
    """Location of a parameter: path, query or header."""
    default: object = None
    is_required: bool = False

    @property
    def shown_default(self) -> str:
        """Its default as it is sent; empty if that says nothing."""
        return "" if self.default in (None, [], {}, "") else json.dumps(self.default).strip('"')

    @property
    def if_omitted(self) -> str:
        """Behaviour without the parameter: an error, its default, or as its text says."""
        if self.is_required:
            return "required"
        return f"`{self.shown_default}`" if self.shown_default else "optional"


@dataclass(frozen=True, slots=True)
class Reply:
    """A response of a call."""

    status: int
    text: str
    kinds: tuple[str, ...]
    """Type of the body, for each media type."""
    codes: tuple[str, ...]
    """Values of `code` in a problem document."""


@dataclass(frozen=True, slots=True)
class Call:
    """One method of one path."""

    tag: str
    name: str
    method: str
    path: str
    text: str
    """Paragraphs and tables in Markdown."""
    parameters: tuple[Member, ...]
    body: str
    """Type of the request body; empty where there is none."""
    replies: tuple[Reply, ...]
    needs_key: bool

    @property
    def title(self) -> str:
        """The method and the path."""
        return f"{self.method} {self.path}"

    @property
    def own_parameters(self) -> tuple[Member, ...]:
        """Its parameters but for the id of a job, which is the same in all calls."""
        return tuple(one for one in self.parameters if one.name != "job_id")


@dataclass(frozen=True, slots=True)
class Object:
    """A JSON object that calls take or return."""

    name: str
    text: str
    members: tuple[Member, ...]
    is_sent: bool
    """Whether requests contain it. A response has all fields: their defaults say nothing."""

    def table(self) -> Iterator[tuple[str, ...]]:
        """Header and rows of a table of its fields, in Markdown."""
        if self.is_sent:
            yield "field", "type", "default", "meaning"
            yield from ((f"`{one.name}`", one.kind, one.if_omitted, one.text) for one in self.members)
        else:
            yield "field", "type", "meaning"
            yield from ((f"`{one.name}`", one.kind, one.text) for one in self.members)


def anchor(name: str) -> str:
    """Name the fragment of a heading, as renderers of Markdown do.

    >>> anchor("Get the picture as PNG")
    'get-the-picture-as-png'
    """
    return name.lower().replace(" ", "-")


def calls_of(document: Schema) -> tuple[Call, ...]:
    """List all calls of an OpenAPI document, tag by tag."""
    found = (
        _call(document, method.upper(), path, item[method])
        for path, item in document["paths"].items()
        for method in METHODS
        if method in item
    )
    return tuple(sorted(found, key=lambda call: [*TITLES].index(call.tag)))


def shared_replies(document: Schema) -> tuple[Reply, ...]:
    """List the responses that calls have in common, by status."""
    found: dict[int, Reply] = {}
    for item in document["paths"].values():
        for operation in item.values():
            for reply in filter(_is_shared, _replies(document, operation)):
                found.setdefault(reply.status, reply)
    return tuple(found[status] for status in sorted(found))


def objects_of(document: Schema) -> tuple[Object, ...]:
    """List the objects that calls take and return, by name, without those of the scene language."""
    operations = [operation for item in document["paths"].values() for operation in item.values()]
    sent = _names(document, [operation.get("requestBody") for operation in operations])
    names = sorted(_names(document, operations))
    return tuple(_object(document, name, is_sent=name in sent) for name in names)


def _names(document: Schema, part: object) -> set[str]:
    """Name the objects that a part of the document refers to, and those that these refer to."""
    schemas = document["components"]["schemas"]
    names: set[str] = set()
    waiting = [*_references(part)]
    while waiting:
        name = waiting.pop()
        if name not in names and name != LEAF and "properties" in schemas[name]:
            names.add(name)
            waiting += _references(schemas[name])
    return names


def _call(document: Schema, method: str, path: str, operation: Schema) -> Call:
    replies = tuple(_replies(document, operation))
    return Call(
        tag=operation["tags"][0],
        name=operation["summary"],
        method=method,
        path=path,
        text=operation["description"],
        parameters=tuple(_parameter(document, given) for given in operation.get("parameters", ())),
        body=" or ".join(_bodies(document, operation.get("requestBody", {}))),
        replies=tuple(reply for reply in replies if not _is_shared(reply)),
        needs_key=any(reply.status == 401 for reply in replies),
    )


def _is_shared(reply: Reply) -> bool:
    return bool(reply.codes) and SHARED_CODES.issuperset(reply.codes)


def _replies(document: Schema, operation: Schema) -> Iterator[Reply]:
    for status, reply in sorted(operation["responses"].items()):
        yield Reply(
            status=int(status),
            text=one_line(reply["description"]),
            kinds=tuple(_bodies(document, reply)),
            codes=tuple(reply.get("x-codes", ())),
        )


def _bodies(document: Schema, carrier: Schema) -> Iterator[str]:
    """Describe a body in each of its media types, except JSON and problem documents."""
    for media_type, content in carrier.get("content", {}).items():
        if media_type == PROBLEM:
            continue
        schema = content.get("schema", {})
        words = kind_of(document, schema) if schema else "object"
        yield words if media_type == "application/json" else f"`{media_type}`"


def _parameter(document: Schema, given: Schema) -> Member:
    schema = given["schema"]
    return Member(
        name=given["name"],
        kind=kind_of(document, schema).removesuffix(" or null").removesuffix(","),
        text=one_line(given.get("description", "")),
        place=given["in"],
        default=schema.get("default"),
    )


def _object(document: Schema, name: str, *, is_sent: bool) -> Object:
    schema = document["components"]["schemas"][name]
    required = schema.get("required", ())
    return Object(
        name=name,
        text=schema.get("description", "").replace("``", "`"),
        members=tuple(
            Member(
                name=field,
                kind=kind_of(document, part),
                text=one_line(part.get("description", "")),
                default=part.get("default"),
                is_required=field in required,
            )
            for field, part in schema["properties"].items()
        ),
        is_sent=is_sent,
    )


def one_line(text: str) -> str:
    """Put Markdown on one line, for a cell of a table."""
    return " ".join(text.replace("``", "`").split())


def kind_of(document: Schema, schema: Schema) -> str:
    """Describe a type in words, with links to objects.

    >>> kind_of({}, {"type": "array", "items": {"type": "integer"}})
    'list of whole numbers'
    >>> kind_of({}, {"anyOf": [{"type": "number", "minimum": 0, "maximum": 1}, {"type": "null"}]})
    'number, 0 to 1, or null'
    >>> kind_of({}, {"type": "object", "additionalProperties": {"type": "string"}})
    'object of texts'
    """
    if "$ref" in schema:
        return _named(document, schema["$ref"].rpartition("/")[2])
    for union in ("anyOf", "oneOf", "allOf"):
        if union in schema:
            kinds = list(dict.fromkeys(kind_of(document, part) for part in schema[union]))
            comma = "," if ", " in kinds[0] else ""
            return f"{comma} or ".join(kinds)
    if "const" in schema or "enum" in schema:
        return _choice(schema.get("enum", [schema.get("const")]))
    match schema.get("type"):
        case "array":
            return _list(document, schema)
        case "object":
            return _mapping(document, schema)
        case "string":
            return _FORMATS.get(schema.get("format", ""), "text")
    return _SIMPLE.get(schema.get("type", ""), "any value") + _range(schema)


def _named(document: Schema, name: str) -> str:
    schema = document["components"]["schemas"][name]
    return f"[{name}](#{anchor(name)})" if "properties" in schema else kind_of(document, schema)


def _choice(values: Sequence[object]) -> str:
    *others, last = [f"`{value}`" for value in values]
    return f"{', '.join(others)} or {last}" if others else last


def _list(document: Schema, schema: Schema) -> str:
    if "prefixItems" in schema:
        kinds = [kind_of(document, item) for item in schema["prefixItems"]]
        return f"{len(kinds)} {_several(kinds[0])}"
    return f"list of {_several(kind_of(document, schema.get('items', {})))}"


def _mapping(document: Schema, schema: Schema) -> str:
    inner = [schema.get("additionalProperties"), *schema.get("patternProperties", {}).values()]
    kinds = [kind_of(document, part) for part in inner if isinstance(part, Mapping)]
    return f"object of {_several(kinds[0])}" if kinds else "object"


def _several(kind: str) -> str:
    if " or " in kind and kind not in _SEVERAL:
        return f"({kind})"
    name, comma, bounds = kind.partition(",")
    arrays = "arrays of " if name[0].isdigit() else ""
    return arrays + _SEVERAL.get(name, name.replace("list of", "lists of")) + comma + bounds


def _range(schema: Schema) -> str:
    low = schema.get("minimum", schema.get("exclusiveMinimum"))
    high = schema.get("maximum", schema.get("exclusiveMaximum"))
    if low is None or high is None or high >= _NO_LIMIT:
        return ""
    above = "above " if "exclusiveMinimum" in schema else ""
    return f", {above}{low:g} to {high:g}"


def _references(part: object) -> Iterator[str]:
    """Find the names of all schemas that a part of the document refers to."""
    if isinstance(part, Mapping):
        if isinstance(part.get("$ref"), str):
            yield part["$ref"].rpartition("/")[2]
        for inner in part.values():
            yield from _references(inner)
    elif isinstance(part, Sequence) and not isinstance(part, str):
        for inner in part:
            yield from _references(inner)
