"""``penumbra validate``: everything that is wrong with a scene file, at once."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Annotated, Any

import typer

from service.cli import output, scene_files
from service.cli.errors import InputError, UnusableSceneError
from service.cli.exits import ExitCode

if TYPE_CHECKING:
    from schemas.problems import Problem

ScenesArgument = Annotated[
    list[str],
    typer.Argument(metavar="SCENE...", help="Scene files; - reads one from stdin.", show_default=False),
]


@dataclass(frozen=True, slots=True)
class Finding:
    """What there is to say about one file."""

    name: str
    text: bytes = b""
    errors: Sequence[Problem] = ()
    warnings: Sequence[Problem] = ()
    more: int = 0

    @property
    def valid(self) -> bool:
        """Whether the file can be rendered."""
        return not self.errors


def validate(scenes: ScenesArgument, as_json: output.JsonOption = False) -> None:
    """Show every error and warning of scene files, each with its pointer, line and column."""
    findings = [_examine(name) for name in scenes]
    if as_json:
        files = [_as_document(finding) for finding in findings]
        output.document({"valid": all(finding.valid for finding in findings), "files": files})
    else:
        for finding in findings:
            _show(finding)
    if not all(finding.valid for finding in findings):
        raise typer.Exit(ExitCode.UNUSABLE_INPUT)


def _examine(name: str) -> Finding:
    from schemas.problems import Problem

    try:
        file = scene_files.read(name)
        file.plan()
    except UnusableSceneError as error:
        return Finding(name, error.text, error.problems, more=error.more)
    except InputError as error:
        return Finding(name, errors=[Problem(pointer="", detail=str(error), code="not_readable")])
    return Finding(name, file.text, warnings=file.scene.warnings)


def _show(finding: Finding) -> None:
    from service.cli.excerpts import excerpts

    output.result(f"{output.emphasis(output.harmless(finding.name))}: {_summary(finding)}")
    for line in excerpts(finding.text, finding.errors, finding.more):
        output.result(line)
    for line in excerpts(finding.text, finding.warnings, kind="warning"):
        output.result(line)


def _summary(finding: Finding) -> str:
    counts = [(len(finding.errors) + finding.more, "error"), (len(finding.warnings), "warning")]
    said = [f"{count} {word}{'s' if count > 1 else ''}" for count, word in counts if count]
    return ", ".join(said) or output.emphasis("ok", "green")


def _as_document(finding: Finding) -> dict[str, Any]:
    return {
        "file": finding.name,
        "valid": finding.valid,
        "errors": [problem.model_dump(exclude_none=True) for problem in finding.errors],
        "more": finding.more,
        "warnings": [problem.model_dump(exclude_none=True) for problem in finding.warnings],
    }
