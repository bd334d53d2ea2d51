"""A conversion: the input of a converter, its notes, and the files it writes."""

from __future__ import annotations

from collections.abc import Container, Sequence
from dataclasses import asdict, dataclass, field, replace
from itertools import chain, count
from pathlib import Path
from typing import Any, Literal

from renderer.assets import AssetError
from renderer.images.reading import image_size
from renderer.meshes.files import read_mesh
from schemas.errors import Problem
from schemas.quantities import LONGEST_NAME
from schemas.reading.findings import located
from service.converting.errors import FileAwayError
from service.converting.files import InputFiles, SceneFiles

Kind = Literal["assumed", "left_out"]


@dataclass(frozen=True, slots=True)
class Assumption:
    """One decision.

    Attributes
    ----------
    kind
        Whether something was `assumed`, or `left_out` because scenes have nothing like it.
    file
        The file that it is about.
    place
        Place in it: a JSON pointer, or the words of an OBJ or MTL file. Empty for the whole file.
    line
        The line, from 1, where the file has lines.
    detail
        The decision, and the cure if it is not what was meant.
    """

    kind: Kind
    file: str
    place: str
    line: int | None
    detail: str

    def as_document(self) -> dict[str, Any]:
        """The same for a program."""
        return asdict(self)


@dataclass(slots=True)
class Notes:
    """The notes on a conversion; `file` is the one that most of them are about."""

    file: str
    # A dict keeps the order and finds repetitions at once: each of a million lines may have its note.
    taken: dict[Assumption, None] = field(default_factory=dict)

    def assume(self, place: str, detail: str, *, line: int | None = None, file: str = "") -> None:
        """Note that something was assumed."""
        self.taken[Assumption("assumed", file or self.file, place, line, detail)] = None

    def leave_out(self, place: str, detail: str, *, line: int | None = None, file: str = "") -> None:
        """Note that something was left out."""
        self.taken[Assumption("left_out", file or self.file, place, line, detail)] = None

    def find_lines(self, text: str | None) -> None:
        """Add lines to notes about the file itself, a JSON text."""
        about = [note for note in self.taken if note.file == self.file]
        positions = located(text, [Problem(pointer=note.place, detail="", code="") for note in about])
        lines = {note: position.line for note, position in zip(about, positions, strict=True)}
        self.taken = {replace(note, line=lines.get(note, note.line)): None for note in self.taken}


def grouped(assumptions: Sequence[Assumption]) -> list[tuple[Assumption, int]]:
    """The first of all that say the same about one file, with how many others there are."""
    counts: dict[tuple[str, str, str], list[Assumption]] = {}
    for assumption in assumptions:
        counts.setdefault((assumption.kind, assumption.file, assumption.detail), []).append(assumption)
    return [(same[0], len(same) - 1) for same in counts.values()]


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
        Collects assumptions.
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
        Assumptions, and parts left out.
    files
        Contents of the files that have to be written beside the scene, by name.
    """

    kind: str
    document: dict[str, Any]
    assumptions: tuple[Assumption, ...]
    files: dict[str, bytes]


class One:
    """A source that has one file."""

    def __init__(self, content: bytes) -> None:
        self.content = content

    def read(self, _name: str) -> bytes:
        """The content, under any name."""
        return self.content


def check_mesh(name: str, content: bytes) -> None:
    """Read a mesh as the renderer will; messages name it so.

    Raises
    ------
    AssetError
        The renderer cannot use it.
    """
    read_mesh(name, One(content))


def picture_file(task: Task, folder: Path, name: str) -> str:
    """The scene's name of a picture.

    Raises
    ------
    FileAwayError
        It is not there.
    AssetError
        It is not a picture that the renderer reads.
    """
    path, content = task.found.read(folder, name)
    image_size(content)
    return task.placed.keep(path, content)


UNUSABLE_FILE_ERRORS = (FileAwayError, AssetError)
"""Errors about a file that cannot be used; their messages give the cure."""


def named_texture(textures: dict[str, Any], texture: dict[str, Any]) -> str:
    """The name of a texture in a scene, after its file; it is added to the scene's textures if it is new.

    Where the file has a texture already, the name also holds everything else that a texture says.
    """
    for name, known in textures.items():
        if known == texture:
            return name
    asset: str = texture["asset"]
    others = ", ".join(f"{value}" for field, value in texture.items() if field not in {"type", "asset"})
    name = free_name(asset if asset not in textures else f"{asset} ({others})", textures)
    textures[name] = texture
    return name


def free_name(name: str, taken: Container[str]) -> str:
    """A free name like this one that is valid in a scene."""
    spellings = chain([name[:LONGEST_NAME]], (f"{name[: LONGEST_NAME - 10]}-{number}" for number in count(2)))
    return next(spelling for spelling in spellings if spelling not in taken)
