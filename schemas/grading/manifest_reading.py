"""Reader of manifests, which reports all problems at once, and their JSON Schema."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from functools import cache
from typing import Any

from schemas.base import member
from schemas.grading.manifests import Manifest
from schemas.json_schema import Generator
from schemas.limits import Limits
from schemas.reading import checked
from schemas.reading.documents import Document, read_text
from schemas.reading.findings import Finding
from schemas.reading.yaml_documents import read_yaml

MANIFEST_LIMITS = Limits(max_body_bytes=1024 * 1024, max_values=100_000)
"""200 tests with everything have some 10 000 values."""

_NO_PICTURE = "No test of the kind 'image' has this id: these mistakes are found in submitted pictures."
_CHARGED = "This mistake is listed before. List all tests that it costs points in together with it, once."
_NOT_BEFORE = "No test with this id is listed before. A test may require those that come before it."
_STORED = (
    "No test has a reference of 'type: scene' with this file, or one has a stored picture of it, which would "
    "be the same for all students."
)
_TWICE = "An earlier test has this id, upper case or lower. Give each test its own: files are named after it."


def read_manifest(data: bytes, *, yaml: bool) -> Manifest:
    """Read a manifest.

    Parameters
    ----------
    data
        The file.
    yaml
        Whether it is YAML; else JSON.

    Raises
    ------
    SceneError
        With every problem, each with its pointer, line and column.
    """
    document = read_yaml(data, MANIFEST_LIMITS) if yaml else read_text(data, MANIFEST_LIMITS)
    document.repeated += (
        *_repeated_ids(document),
        *_impossible_requirements(document),
        *_impossible_charges(document),
        *_impossible_variants(document),
    )
    return checked(document, Manifest, limits=MANIFEST_LIMITS)


def _repeated_ids(document: Document) -> Iterator[Finding]:
    seen: set[str] = set()
    for index, test in enumerate(_listed(document.content, "tests")):
        name = member(test, "id")
        if isinstance(name, str):
            if name.lower() in seen:
                yield Finding(("tests", index, "id"), "id_twice", _TWICE)
            seen.add(name.lower())


def _impossible_requirements(document: Document) -> Iterator[Finding]:
    before: set[object] = set()
    for index, test in enumerate(_listed(document.content, "tests")):
        for place, name in _texts(test, "requires"):
            if name not in before:
                yield Finding(("tests", index, "requires", place), "unknown_test", _NOT_BEFORE)
        before.add(str(member(test, "id")))


def _impossible_charges(document: Document) -> Iterator[Finding]:
    """Find charges to tests that judge no submitted picture, and mistakes that are charged twice."""
    pictures = {member(test, "id") for test in _listed(document.content, "tests") if _is_image(test)}
    seen: set[str] = set()
    for index, charge in enumerate(_listed(document.content, "charged_once")):
        for place, name in _texts(charge, "tests"):
            if name not in pictures:
                yield Finding(("charged_once", index, "tests", place), "unknown_test", _NO_PICTURE)
        for place, kind in _texts(charge, "mistakes"):
            if kind in seen:
                yield Finding(("charged_once", index, "mistakes", place), "charged_twice", _CHARGED)
            seen.add(kind)


def _impossible_variants(document: Document) -> Iterator[Finding]:
    """Find scenes that should differ from student to student, but are not rendered as a reference."""
    references = [member(test, "reference") for test in _listed(document.content, "tests")]
    rendered = {member(each, "file") for each in references if member(each, "type") == "scene"}
    stored = {member(each, "scene") for each in references if member(each, "type") == "picture"}
    for place, name in _texts(member(document.content, "per_student"), "scenes"):
        if name not in rendered or name in stored:
            yield Finding(("per_student", "scenes", place), "not_rendered", _STORED)


def _texts(content: object, name: str) -> Iterator[tuple[int, str]]:
    """The texts of an array in a raw document, with their places."""
    for place, text in enumerate(_listed(content, name)):
        if isinstance(text, str):
            yield place, text


def _is_image(test: object) -> bool:
    return member(test, "kind") == "image" and isinstance(member(test, "id"), str)


def _listed(content: object, name: str) -> Iterator[object]:
    """The entries of an array in a raw document; none if it is missing."""
    parts = member(content, name) if isinstance(content, Mapping) else ()
    yield from parts if isinstance(parts, list | tuple) else ()


_EXAMPLE = {
    "schema": "penumbra/manifest/v1",
    "title": "A ball on a table",
    "charged_once": [{"mistakes": ["encoding", "orientation"], "tests": ["shadow"]}],
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

    It checks each field. Only `schemas.grading.manifest_reading` compares fields with each other: ids, and
    the order of thresholds.
    """
    return Manifest.model_json_schema(schema_generator=Generator) | {"examples": [_EXAMPLE]}
