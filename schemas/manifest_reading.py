"""Reading the manifest of an assignment: YAML or JSON in, a checked manifest or all its problems out."""

from __future__ import annotations

from collections.abc import Iterator, Mapping

from schemas.base import member
from schemas.documents import Document, read_text
from schemas.findings import Finding
from schemas.limits import Limits
from schemas.manifests import Manifest
from schemas.reading import checked
from schemas.yaml_documents import read_yaml

MANIFEST_LIMITS = Limits(max_body_bytes=1024 * 1024, max_values=100_000)
"""200 tests with everything have some 10 000 values."""

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
    document.repeated += _repeated_ids(document)
    return checked(document, Manifest, limits=MANIFEST_LIMITS)


def _repeated_ids(document: Document) -> Iterator[Finding]:
    tests = member(document.content, "tests") if isinstance(document.content, Mapping) else ()
    seen: set[str] = set()
    for index, test in enumerate(tests if isinstance(tests, list | tuple) else ()):
        name = member(test, "id")
        if isinstance(name, str):
            if name.lower() in seen:
                yield Finding(("tests", index, "id"), "id_twice", _TWICE)
            seen.add(name.lower())
