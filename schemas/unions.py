"""Choosing the right class of a union by what the user wrote, with tags that never reach the user.

Pydantic puts the tag of the chosen class into the location of every problem. A user's document has no such
level, so tags begin with a character that cannot be meant and are taken out again by `schemas.reading`.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any

from pydantic import Discriminator, Tag
from pydantic.fields import FieldInfo

from schemas.base import Closed, member

MARK = "\x00"
MODELS: dict[str, type[Closed]] = {}
"""Every tag with its class, for suggestions."""


def tag(model: type[Closed]) -> Tag:
    """Make the tag of one class of a union."""
    name = MARK + model.__name__
    MODELS[name] = model
    return Tag(name)


def chosen_by(forms: Mapping[str, tuple[type[Closed], ...]]) -> Discriminator:
    """Choose by `type`, and among several forms of one type by the fields that only one of them requires.

    Parameters
    ----------
    forms
        For each value of `type` its classes; the first is taken where no field decides.
    """

    def choose(value: Any) -> str | None:
        if isinstance(value, Closed):
            return MARK + type(value).__name__
        kind = member(value, "type")
        candidates = forms.get(kind) if isinstance(kind, str) else None
        return MARK + _best(candidates, value).__name__ if candidates else None

    return Discriminator(choose, custom_error_type="unknown_type", custom_error_message=_offer(forms))


def _best(candidates: tuple[type[Closed], ...], value: Mapping[str, object]) -> type[Closed]:
    return max(candidates, key=lambda model: sum(name in value for name in _own(model)))


def _own(model: type[Closed]) -> list[str]:
    fields: dict[str, FieldInfo] = model.model_fields
    return [name for name, field in fields.items() if field.is_required()]


def _offer(forms: Mapping[str, tuple[type[Closed], ...]]) -> str:
    names = list(forms)
    listed = f"one of {', '.join(repr(name) for name in names)}" if len(names) > 1 else repr(names[0])
    return f"'type' must be {listed}."
