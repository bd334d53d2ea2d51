"""What every importer is given, and what it makes."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any

from service.converting.assumptions import Assumption, Notes
from service.converting.files import InputFiles, SceneFiles


@dataclass(frozen=True, slots=True)
class Task:
    """One file to be converted.

    Attributes
    ----------
    path
        The file; others are named from its folder.
    content
        Its bytes.
    notes
        What is assumed is written down here.
    found
        Files that it may name.
    placed
        Files of the new scene.
    """

    path: Path
    content: bytes
    notes: Notes
    found: InputFiles
    placed: SceneFiles

    @property
    def folder(self) -> Path:
        """From where the input names its files."""
        return self.path.parent


@dataclass(frozen=True, slots=True)
class Conversion:
    """A scene made out of another file.

    Attributes
    ----------
    kind
        The format that it came from, in words.
    document
        The scene, which is valid.
    assumptions
        What was assumed or left out.
    files
        Contents of the files that have to be written beside the scene, by name.
    """

    kind: str
    document: dict[str, Any]
    assumptions: tuple[Assumption, ...]
    files: dict[str, bytes]
