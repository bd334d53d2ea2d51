"""Reading a document: bytes in, a checked model and its warnings out, or all its problems at once.

Three steps: `schemas.reading.documents` parses strictly, pydantic validates, and problems are put into the
user's words (`schemas.reading.translation`) and places (`schemas.reading.findings`).
"""

from __future__ import annotations

from collections.abc import Mapping
from os import PathLike
from pathlib import Path
from typing import TypeVar

from pydantic import BaseModel, ValidationError

from schemas.base import Closed
from schemas.errors import Problem, SceneError
from schemas.limits import Limits, limits_in_force
from schemas.quality import FixedQuality, Quality, TargetQuality
from schemas.reading.advice import advise
from schemas.reading.documents import Document, Source, read_text
from schemas.reading.file_kinds import mistaken_object
from schemas.reading.findings import Finding, refusal, show
from schemas.reading.translation import translate
from schemas.scene import Scene

Model = TypeVar("Model", bound=BaseModel)


def read_scene(data: Source, *, limits: Limits | None = None) -> tuple[Scene, tuple[Problem, ...]]:
    """Read a scene.

    Parameters
    ----------
    data
        JSON as bytes or text, or a document that is parsed already (then problems have no lines).
    limits
        Limits of the scene's size; by default those of the environment.

    Returns
    -------
    tuple
        The scene, and warnings about valid values that are probably unintended.

    Raises
    ------
    SceneError
        With every problem.
    """
    return read_document(data, Scene, limits=limits)


def read_document(
    data: Source, model: type[Model], *, limits: Limits | None = None
) -> tuple[Model, tuple[Problem, ...]]:
    """Read a document of any model, such as a request with a scene in one of its fields.

    Parameters and errors are those of `read_scene`; pointers lead into the whole document.
    """
    limits = limits_in_force() if limits is None else limits
    wants_scene = issubclass(model, Scene)
    document = read_text(data, limits, wanted="a scene" if wants_scene else "a JSON document")
    other = mistaken_object(document.content) if wants_scene else None
    if other:
        raise _refused([Finding((), "wrong_file", other)], document)
    read = checked(document, model, limits=limits)
    return read, _warnings(read, document)


class _QualityMember(Closed):
    """The part of a request that `read_quality` reads, so that its pointers are those of a request."""

    quality: Quality


def read_quality(data: object, *, limits: Limits | None = None) -> FixedQuality | TargetQuality:
    """Read the quality of a request: a finished one stays as it is, a dict is validated as over HTTP.

    Raises
    ------
    SceneError
        With every problem; pointers begin with ``/quality``.
    """
    if isinstance(data, FixedQuality | TargetQuality):
        return data
    return read_document({"quality": data}, _QualityMember, limits=limits)[0].quality


def checked(document: Document, model: type[Model], *, limits: Limits) -> Model:
    """Make a model of a document that is parsed already.

    Raises
    ------
    SceneError
        With every problem.
    """
    try:
        read = model.model_validate(document.content, context=limits)
    except ValidationError as error:
        misplaced = _misplaced(document.content, model)
        if misplaced is not None:
            raise _refused([misplaced], document) from None
        findings, more = translate(error, model, document.content)
        raise _refused([*document.repeated, *findings], document, more) from None
    if document.repeated:
        raise _refused(document.repeated, document)
    return read


def _misplaced(content: object, model: type[BaseModel]) -> Finding | None:
    """Recognise a scene where a request belongs: that is one mistake."""
    if not isinstance(content, Mapping):
        return None
    field = model.model_fields.get("scene")
    if field and field.annotation is Scene and "camera" in content and "scene" not in content:
        detail = 'This is a scene, and a request with a scene belongs here. Wrap it: {"scene": {...}}.'
        return Finding((), "bare_scene", detail)
    return None


def _refused(findings: list[Finding], document: Document, more: int = 0) -> SceneError:
    return refusal(findings, document.content, document.text, more, document.find)


def _warnings(read: BaseModel, document: Document) -> tuple[Problem, ...]:
    if isinstance(read, Scene):
        findings = advise(read)
    else:
        findings = [
            Finding((name, *finding.location), finding.code, finding.detail)
            for name, value in read
            if isinstance(value, Scene)
            for finding in advise(value)
        ]
    return show(findings, document.content, document.text) if findings else ()


def scene_path(source: object) -> Path:
    """The path of a scene file, where it is one.

    Raises
    ------
    TypeError
        It is of no kind that a scene may be given as.
    ValueError
        It is the text of a scene, which no file is called.
    """
    if not isinstance(source, str | PathLike):
        kind = type(source).__name__
        raise TypeError(f"A scene is a path, JSON as bytes, a dict or a schemas.Scene, not {kind}.")
    if isinstance(source, str) and source.lstrip().startswith("{"):
        raise ValueError("This text is a scene, not the path of one. Give it as bytes: text.encode().")
    return Path(source)
