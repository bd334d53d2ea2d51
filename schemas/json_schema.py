"""The scene language as JSON Schema, for editors and other programs."""

from __future__ import annotations

from functools import cache
from typing import Any

from pydantic.json_schema import GenerateJsonSchema, JsonSchemaMode, JsonSchemaValue
from pydantic_core.core_schema import ModelSchema, TupleSchema

from schemas.base import fields_of
from schemas.scene import Scene

DIALECT = "https://json-schema.org/draft/2020-12/schema"


_EXAMPLE = {
    "version": 1,
    "name": "a ball on a table",
    "camera": {"position": [0, 2, 8], "look_at": [0, 1, 0], "width": 512, "height": 512},
    "ambient": [1, 1, 1],
    "materials": {
        "table": {"type": "phong", "color": [0.75, 0.75, 0.75]},
        "ball": {"type": "phong", "color": [0.65, 0.12, 0.1], "specular": 0.4, "shininess": 40},
    },
    "shapes": [
        {
            "type": "rectangle",
            "center": [0, 0, 0],
            "normal": [0, 1, 0],
            "tangent": [1, 0, 0],
            "size": [6, 6],
            "material": "table",
        },
        {"type": "ellipsoid", "center": [0, 1, 0], "radius": 1, "material": "ball"},
    ],
    "lights": [
        {
            "type": "rectangle",
            "corner": [-1, 5, -1],
            "edges": [[2, 0, 0], [0, 0, 2]],
            "color": [0.8, 0.8, 0.8],
        }
    ],
}


class Generator(GenerateJsonSchema):
    """Describes user input, with fields in reading order."""

    def generate(self, schema: Any, mode: JsonSchemaMode = "validation") -> JsonSchemaValue:
        """The schema of a whole document, with its dialect."""
        return {"$schema": DIALECT, **super().generate(schema, mode)}

    def tuple_schema(self, schema: TupleSchema) -> JsonSchemaValue:
        """An array of a fixed length."""
        # [3] numbers of one kind are described once, not three times.
        described = super().tuple_schema(schema)
        kinds = described.get("prefixItems", [])
        if kinds and all(kind == kinds[0] for kind in kinds):
            del described["prefixItems"]
            described["items"] = kinds[0]
        return described

    def model_schema(self, schema: ModelSchema) -> JsonSchemaValue:
        """An object."""
        described = super().model_schema(schema)
        properties = described.get("properties", {})
        described["properties"] = {
            name: properties[name] for name in fields_of(schema["cls"]) if name in properties
        }
        return described


@cache
def scene_json_schema() -> dict[str, Any]:
    """Describe a scene in JSON Schema, draft 2020-12.

    It checks each field. Only `schemas.reading` compares fields with each other: names, square sample
    numbers, parallel vectors.
    """
    return Scene.model_json_schema(schema_generator=Generator) | {"examples": [_EXAMPLE]}
