"""Write docs/reference/manifest.md from the schemas."""

from __future__ import annotations

import inspect
import json
from pathlib import Path
from typing import Any

from schemas.base import Closed, fields_of
from schemas.grading import acceptance, manifests
from schemas.grading.manifest_reading import manifest_json_schema
from tools.docs.field_tables import an_object, table_of_fields
from tools.docs.templates import filled

PAGE = Path(__file__).parents[2] / "docs" / "reference" / "manifest.md"
TEMPLATE = Path(__file__).with_name("manifest_template.txt")


def page() -> str:
    """Build the page: each placeholder of the template names a model."""
    return filled(TEMPLATE, part)


def part(name: str) -> str:
    """The text for a placeholder of the template."""
    if name == "example":
        return json.dumps(manifest_json_schema()["examples"][0], indent=2)
    model: type[Closed] = getattr(manifests, name, None) or getattr(acceptance, name)
    return f"{chosen(model)}{inspect.getdoc(model)}\n\n{fields(model)}"


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


def fields(model: type[Closed]) -> str:
    """Describe the fields of a model, one per row; fields shared by all tests have their own table."""
    left_out = {"kind", "by", "type"} & set(model.model_fields)
    if issubclass(model, manifests.Criterion) and model is not manifests.Criterion:
        left_out |= set(manifests.Criterion.model_fields)
    names = [name for name in fields_of(model) if name not in left_out]
    return table_of_fields(described(model), names, an_object)
