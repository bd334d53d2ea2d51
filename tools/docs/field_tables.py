"""Tables of the fields of a model, in words for its JSON Schema."""

from __future__ import annotations

import json
from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

from tools.docs.templates import table

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable

Schema = Mapping[str, Any]


def table_of_fields(schema: Schema, names: Iterable[str], alternative: Callable[[str], str]) -> str:
    """A row for each of the named fields of an object: its type, default and meaning.

    `alternative` says what stands for a definition, given its name, where several are possible.
    """
    required = schema.get("required", [])
    rows = []
    for name in names:
        field = schema["properties"][name]
        default = "required" if name in required else default_of(field)
        rows.append((f"`{name}`", words(field, alternative), default, field.get("description", "The kind.")))
    return table(("field", "type", "default", "meaning"), rows)


def default_of(field: Schema) -> str:
    """A default; the description explains computed ones."""
    default = field.get("default")
    return "" if default is None else f"`{json.dumps(default)}`"


def an_object(name: str) -> str:
    """Words for a definition that has a section of its own."""
    return f"{name} object"


def words(field: Schema, alternative: Callable[[str], str]) -> str:
    """The type of a value."""
    if options := field.get("anyOf"):
        return " or ".join(words(option, alternative) for option in options if option != {"type": "null"})
    if options := field.get("oneOf"):
        return " or ".join(dict.fromkeys(alternative(defined(option)) for option in options))
    if "$ref" in field:
        return an_object(defined(field))
    if "const" in field or "enum" in field:
        return " or ".join(f"`{json.dumps(value)}`" for value in field.get("enum", [field.get("const")]))
    return compound(field, alternative)


def compound(field: Schema, alternative: Callable[[str], str]) -> str:
    """The type of an array, an object of named things, or a plain value."""
    match field["type"]:
        case "array":
            entries, count = words(field["items"], alternative), field.get("minItems")
            if not count or count != field.get("maxItems"):
                return f"array of {entries}"
            return f"{count} x {entries}" if entries[0].isdigit() else f"{count} {entries}s"
        case "object" if "additionalProperties" in field:
            return f"object of names, each with {words(field['additionalProperties'], alternative)}"
        case "integer":
            return "whole number"
        case "string":
            return "text"
    return str(field["type"])


def defined(reference: Schema) -> str:
    """The name of the definition that a reference leads to."""
    return str(reference["$ref"].rpartition("/")[2])
