"""Reading a document of another program: required fields are checked, unknown ones noted."""

from __future__ import annotations

import types
from collections.abc import Iterator, Mapping
from typing import Any, ClassVar, TypeVar, Union, get_args, get_origin

from pydantic import AliasChoices, BaseModel, ValidationError
from pydantic.fields import FieldInfo

from schemas.base import Closed
from schemas.limits import limits_in_force
from schemas.pointers import Parts, pointer
from schemas.reading.findings import show
from schemas.reading.translation import translate
from service.converting.errors import ConversionError
from service.converting.task import Notes


class Foreign(Closed):
    """Base of documents of other programs: closed like scenes, after unknown fields were removed."""

    SILENT: ClassVar[frozenset[str]] = frozenset()
    """Fields that change no picture: left out without a word."""
    REASONS: ClassVar[Mapping[str, str]] = {}
    """Reasons why known fields are left out."""


Model = TypeVar("Model", bound=Foreign)


def read_known(content: object, model: type[Model], notes: Notes, text: str | None) -> Model:
    """Read the known fields of a document, and note the others.

    Parameters
    ----------
    content
        The parsed document.
    model
        Model of its format.
    text
        The document as it was written, so that problems have lines; None if it is no text for people.

    Raises
    ------
    ConversionError
        With every problem, pointers into the document.
    """
    unknown: list[tuple[Parts, str]] = []
    known = _known(content, model, (), unknown)
    for parts, reason in unknown:
        notes.leave_out(pointer(parts), reason)
    try:
        return model.model_validate(known, context=limits_in_force())
    except ValidationError as error:
        findings, more = translate(error, model, known)
        problems = show(findings, content, text)
        raise ConversionError(notes.file, (text or "").encode(), problems, more) from None


def _known(value: object, annotation: object, parts: Parts, unknown: list[tuple[Parts, str]]) -> object:
    """A value without the fields that its model does not have."""
    model = _model_in(annotation)
    if model is None:
        return value
    if isinstance(value, list | tuple):
        return [_known(item, annotation, (*parts, number), unknown) for number, item in enumerate(value)]
    if not isinstance(value, Mapping):
        return value
    if _is_dict(annotation):
        return {key: _known(item, model, (*parts, key), unknown) for key, item in value.items()}
    fields = dict(_names(model))
    unknown.extend(
        ((*parts, key), model.REASONS.get(key, f"The field '{key}' is unknown here."))
        for key in value
        if key not in fields and key not in model.SILENT
    )
    return {
        key: _known(value[key], field.annotation, (*parts, key), unknown)
        for key, field in fields.items()
        if key in value
    }


def _names(model: type[Foreign]) -> Iterator[tuple[str, FieldInfo]]:
    for name, field in model.model_fields.items():
        alias = field.validation_alias
        for choice in alias.choices if isinstance(alias, AliasChoices) else [alias or name]:
            yield str(choice), field


def _model_in(annotation: object) -> type[Foreign] | None:
    if isinstance(annotation, type) and issubclass(annotation, BaseModel):
        return annotation if issubclass(annotation, Foreign) else None
    for inner in get_args(annotation):
        found = _model_in(inner)
        if found is not None:
            return found
    return None


def _is_dict(annotation: Any) -> bool:
    if get_origin(annotation) in {Union, types.UnionType}:
        return any(_is_dict(inner) for inner in get_args(annotation))
    return get_origin(annotation) is dict
