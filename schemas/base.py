"""Base classes of the scene language: closed objects, and unions of them."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from types import UnionType
from typing import Annotated, Any, Union, get_args, get_origin

from pydantic import BaseModel, ConfigDict, Discriminator, Tag

from schemas.pointers import Parts


class Closed(BaseModel):
    """Base of user input: immutable, and unknown fields are refused.

    Numbers are strict one by one (see `schemas.quantities`), so that arrays may be JSON arrays, Python
    lists or tuples alike.
    """

    model_config = ConfigDict(extra="forbid", frozen=True, hide_input_in_errors=True)


class Message(BaseModel):
    """Base of every answer of the service: frozen, open to fields of later versions."""

    model_config = ConfigDict(frozen=True, extra="ignore")


def member(value: object, name: str) -> object:
    """Give a field of a raw JSON object or of a model; None if it is missing."""
    if isinstance(value, Mapping):
        return value.get(name)
    return getattr(value, name, None)


_FIRST_AND_LAST = {"type": -1, "material": 1, "name": 2}


def fields_of(model: type[BaseModel]) -> list[str]:
    """List the fields of a model in the order in which people read them."""
    written = [field.alias or name for name, field in model.model_fields.items()]
    return sorted(written, key=lambda name: _FIRST_AND_LAST.get(name, 0))


MARK = "\x00"
MODELS: dict[str, type[Closed]] = {}
"""Classes by tag, for suggestions."""
FORMS: dict[type[BaseModel], tuple[type[Closed], ...]] = {}
"""All forms of each class's type: a rectangle has one by its centre, and one by its edges."""


def tag(model: type[Closed]) -> Tag:
    """Make the tag of one class of a union."""
    name = MARK + model.__name__
    MODELS[name] = model
    return Tag(name)


def chosen_by(forms: Mapping[str, tuple[type[Closed], ...]], *, field: str = "type") -> Discriminator:
    """Choose a class by `type`, and among several forms of one type by the fields that only one requires.

    Parameters
    ----------
    forms
        Classes by value of `type`; the first is the default if no field decides.
    field
        Used in place of `type`. It may be missing if all forms have a default for it: then the fields that
        only one requires decide.
    """
    required = {model: required_fields(model) for models in forms.values() for model in models}
    FORMS.update({model: models for models in forms.values() for model in models})
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
        if len(candidates) == 1:
            return MARK + candidates[0].__name__
        best = max(candidates, key=lambda model: fullness(value, required[model]))
        return MARK + best.__name__

    return Discriminator(
        choose,
        custom_error_type="unknown_type",
        custom_error_message=_offer(field, tuple(forms)),
    )


def members(union: Any) -> tuple[type[BaseModel], ...]:
    """Classes of a union, through the annotations around it."""
    if get_origin(union) is Annotated:
        return members(get_args(union)[0])
    if get_origin(union) in (Union, UnionType):
        return tuple(model for part in get_args(union) for model in members(part))
    return (union,)


def fullness(value: Mapping[str, Any], names: Sequence[str]) -> float:
    """Share of some fields that an object has, 0 to 1."""
    return sum(name in value for name in names) / len(names) if names else 0.0


def required_fields(model: type[BaseModel]) -> tuple[str, ...]:
    """Required fields of a class."""
    return tuple(name for name, field in model.model_fields.items() if field.is_required())


def _offer(field: str, names: tuple[str, ...]) -> str:
    quoted = [f"'{name}'" for name in names]
    return f"The field '{field}' must be {'one of ' if len(names) > 1 else ''}{', '.join(quoted)}."


def deciding_fields(model: type[BaseModel]) -> tuple[str, ...]:
    """Required fields that some other form of the same type does not require: those that choose the form."""
    shared = set.intersection(*(set(required_fields(form)) for form in FORMS.get(model, (model,))))
    return tuple(name for name in required_fields(model) if name not in shared)


def form_with(field: str, model: type[BaseModel] | None) -> type[BaseModel] | None:
    """The form of the same type that has a field which this one lacks; None if there is none."""
    forms = FORMS.get(model, ()) if model else ()
    return next((form for form in forms if form is not model and field in form.model_fields), None)


def model_at(model: type[BaseModel] | None, location: Sequence[str | int]) -> type[BaseModel] | None:
    """Find the model that contains the last part of a location with tags; None if no model does."""
    for part in location[:-1]:
        if isinstance(part, str) and part.startswith(MARK):
            model = MODELS[part]
        elif model is not None and isinstance(part, str):
            field = model.model_fields.get(part)
            model = _model_in(field.annotation) if field else None
    return model


def _model_in(annotation: object) -> type[BaseModel] | None:
    for candidate in (annotation, *get_args(annotation)):
        if isinstance(candidate, type) and issubclass(candidate, BaseModel):
            return candidate
    return None


def untagged(location: Iterable[str | int]) -> Parts:
    """A location without tags, as in the user's document."""
    return tuple(part for part in location if not (isinstance(part, str) and part.startswith(MARK)))
