"""Write docs/reference/manifest.md from the schemas.

Run it with ``python tools/docs/generate_manifest_reference.py``.
"""

from __future__ import annotations

import inspect
import json
import re
from pathlib import Path
from typing import Any

from schemas.base import Closed, fields_of
from schemas.grading import acceptance, manifests
from schemas.grading.manifest_reading import manifest_json_schema

PAGE = Path(__file__).parents[2] / "docs" / "reference" / "manifest.md"
TEMPLATE = Path(__file__).with_name("manifest_template.txt")

PLACE = re.compile(r"^\{(\w+)\}$", re.MULTILINE)


def page() -> str:
    """Build the page: each placeholder of the template names a model."""
    return PLACE.sub(lambda place: filled(place[1]), TEMPLATE.read_text(encoding="utf-8"))


def filled(name: str) -> str:
    """The text for a placeholder of the template."""
    if name == "example":
        return json.dumps(manifest_json_schema()["examples"][0], indent=2)
    model: type[Closed] = getattr(manifests, name, None) or getattr(acceptance, name)
    return f"{chosen(model)}{inspect.getdoc(model)}\n\n{table(model)}"


def chosen(model: type[Closed]) -> str:
    """The name of a model, and its discriminator field if it has one."""
    for field in ("kind", "by", "type"):
        if field in model.model_fields:
            value = described(model)["properties"][field]["const"]
            return f"**{model.__name__}** (`{field}: {value}`): "
    return f"**{model.__name__}**: "


def described(model: type[Closed]) -> dict[str, Any]:
    """A model in JSON Schema."""
    whole = manifest_json_schema()
    found: dict[str, Any] = whole["$defs"].get(model.__name__) or whole
    return model.model_json_schema() if model is manifests.Criterion else found


def table(model: type[Closed]) -> str:
    """Describe the fields of a model, one per row; fields shared by all tests have their own table."""
    schema = described(model)
    left_out = {"kind", "by", "type"} & set(model.model_fields)
    if issubclass(model, manifests.Criterion) and model is not manifests.Criterion:
        left_out |= set(manifests.Criterion.model_fields)
    rows = ["| field | type | default | meaning |", "| --- | --- | --- | --- |"]
    for name in fields_of(model):
        if name not in left_out:
            field = schema["properties"][name]
            default = "required" if name in schema.get("required", []) else default_of(field)
            rows.append(f"| `{name}` | {words(field)} | {default} | {field['description']} |")
    return "\n".join(rows)


def default_of(field: dict[str, Any]) -> str:
    """Format a default; the description explains computed ones."""
    default = field.get("default")
    return "" if default in (None, []) else f"`{json.dumps(default)}`"


def words(field: dict[str, Any]) -> str:
    """Describe the type of a value."""
    options = field.get("anyOf") or field.get("oneOf")
    if options:
        return " or ".join(dict.fromkeys(words(option) for option in options if option != {"type": "null"}))
    if "$ref" in field:
        return f"{field['$ref'].rpartition('/')[2]} object"
    if "const" in field or "enum" in field:
        return " or ".join(f"`{json.dumps(value)}`" for value in field.get("enum", [field.get("const")]))
    match field["type"]:
        case "array":
            inner, most = words(field["items"]), field.get("maxItems")
            exact = most is not None and most == field.get("minItems")
            return f"{most} {inner}s" if exact else f"array of {inner}"
        case "integer":
            return "whole number"
        case "string":
            return "text"
    return str(field["type"])


if __name__ == "__main__":
    PAGE.write_text(page(), encoding="utf-8")
