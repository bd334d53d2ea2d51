"""Records of the files that a test reads."""

from __future__ import annotations

import hashlib

from accuracy.comparison import Picture
from schemas.grading.grades import GradeInput
from service.grading.folders import Role


def of_picture(test: str, role: Role, picture: Picture, size: int | None) -> GradeInput:
    """A picture; `size` is None if it was rendered here."""
    samples = picture.layers.get("samples")
    return GradeInput(
        test=test,
        role=role,
        name=picture.name,
        sha256=picture.sha256,
        size=size,
        width=picture.width,
        height=picture.height,
        encoding=picture.encoding,
        samples=None if samples is None else float(samples.mean()),
    )


def of_file(test: str, role: Role, name: str, content: bytes) -> GradeInput:
    """Any other file."""
    digest = hashlib.sha256(content).hexdigest()
    return GradeInput(test=test, role=role, name=name, sha256=digest, size=len(content))
