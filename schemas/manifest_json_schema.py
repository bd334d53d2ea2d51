"""The manifest of an assignment as JSON Schema, for editors and other programs."""

from __future__ import annotations

from functools import cache
from typing import Any

from schemas.json_schema import Generator
from schemas.manifests import Manifest

_EXAMPLE = {
    "schema": "penumbra/manifest/v1",
    "title": "A ball on a table",
    "tests": [
        {
            "id": "shadow",
            "name": "A soft shadow",
            "kind": "image",
            "points": 25,
            "submitted": {"file": "soft.png", "encoding": "srgb"},
            "reference": {"type": "scene", "file": "scenes/soft.json"},
            "accept": {"by": "verdict", "zero": 0.3},
        },
        {
            "id": "rays",
            "name": "What rays hit",
            "kind": "rays",
            "points": 30,
            "submitted": {"type": "hits", "file": "hits.npz"},
            "reference": "scenes/soft.json",
            "rays": {"type": "file", "file": "rays.npz"},
            "accept": {"full": 0.99, "zero": 0.5},
        },
    ],
}


@cache
def manifest_json_schema() -> dict[str, Any]:
    """Describe a manifest in JSON Schema, draft 2020-12.

    It says all that such a schema can say. What compares fields with each other (ids, the order of
    thresholds) only `schemas.manifest_reading` checks.
    """
    return Manifest.model_json_schema(schema_generator=Generator) | {"examples": [_EXAMPLE]}
