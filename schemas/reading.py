"""Reading a document: bytes in, a checked model and its warnings out."""

from __future__ import annotations

import json
from collections.abc import Mapping
from typing import TypeVar

from pydantic import BaseModel, ValidationError

from schemas.errors import SceneError
from schemas.limits import Limits
from schemas.problems import Problem
from schemas.scene import Scene

Model = TypeVar("Model", bound=BaseModel)


def read_scene(
    data: bytes | str | Mapping[str, object], *, limits: Limits | None = None
) -> tuple[Scene, tuple[Problem, ...]]:
    """Read a scene."""
    return read_document(data, Scene, limits=limits)


def read_document(
    data: bytes | str | Mapping[str, object], model: type[Model], *, limits: Limits | None = None
) -> tuple[Model, tuple[Problem, ...]]:
    """Read a document of any model."""
    raw = data if isinstance(data, Mapping) else json.loads(data)
    try:
        return model.model_validate(raw), ()
    except ValidationError as error:
        raise SceneError(
            [
                Problem(
                    pointer="".join(f"/{part}" for part in item["loc"] if not str(part).startswith("\x00")),
                    detail=item["msg"],
                    code=item["type"],
                )
                for item in error.errors(include_url=False, include_input=False)
            ]
        ) from None
