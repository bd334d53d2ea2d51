"""What all parts of the scene language share: closed, unchangeable objects."""

from __future__ import annotations

from collections.abc import Mapping

from pydantic import BaseModel, ConfigDict


class Closed(BaseModel):
    """Base of everything a user writes: unknown fields are refused, values never change.

    Numbers are strict one by one (see `schemas.quantities`), so that arrays may be JSON arrays, Python
    lists or tuples alike.
    """

    model_config = ConfigDict(extra="forbid", frozen=True, hide_input_in_errors=True)


def member(value: object, name: str) -> object:
    """Give a field of a raw JSON object or of a finished model; None where there is none."""
    if isinstance(value, Mapping):
        return value.get(name)
    return getattr(value, name, None)


_FIRST_AND_LAST = {"type": -1, "material": 1, "name": 2}


def fields_of(model: type[BaseModel]) -> list[str]:
    """List the fields of a model in the order in which people read them."""
    written = [field.alias or name for name, field in model.model_fields.items()]
    return sorted(written, key=lambda name: _FIRST_AND_LAST.get(name, 0))
