"""Choosing the right class of a union by what the user wrote, with tags that never reach the user.

Pydantic puts the tag of the chosen class into the location of every problem. A user's document has no such
level, so tags begin with a character that cannot be meant and are taken out again by `schemas.reading`.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from pydantic import Discriminator, Tag

from schemas.base import Closed

MARK = "\x00"
MODELS: dict[str, type[Closed]] = {}
"""Every tag with its class, for suggestions."""


def tag(model: type[Closed]) -> Tag:
    """Make the tag of one class of a union."""
    name = MARK + model.__name__
    MODELS[name] = model
    return Tag(name)


def chosen_by(forms: Mapping[str, tuple[type[Closed], ...]], *, field: str = "type") -> Discriminator:
    """Choose by `type`, and among several forms of one type by the fields that only one of them requires.

    Parameters
    ----------
    forms
        For each value of `type` its classes; the first is taken where no field decides.
    field
        What is looked at in place of `type`. Where all forms have a default for it, it may be missing: the
        fields that only one of them requires decide then.
    """
    required = {model: _required(model) for models in forms.values() for model in models}
    optional = not any(field in names for names in required.values())

    def choose(value: Any) -> str | None:
        if isinstance(value, Closed):
            return MARK + type(value).__name__
        if not isinstance(value, Mapping):
            return None
        kind = value.get(field)
        candidates = forms.get(kind) if isinstance(kind, str) else None
        if optional and field not in value:
            candidates = tuple(required)
        if not candidates:
            return None
        best = max(candidates, key=lambda model: sum(name in value for name in required[model]))
        return MARK + best.__name__

    return Discriminator(
        choose,
        custom_error_type="unknown_type",
        custom_error_message=_offer(field, tuple(forms)),
    )


def _required(model: type[Closed]) -> tuple[str, ...]:
    return tuple(name for name, field in model.model_fields.items() if field.is_required())


def _offer(field: str, names: tuple[str, ...]) -> str:
    quoted = [f"'{name}'" for name in names]
    return f"The field '{field}' must be {'one of ' if len(names) > 1 else ''}{', '.join(quoted)}."
