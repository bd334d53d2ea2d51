"""The table of formats, and the conversion that they share."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from schemas.errors import SceneError
from schemas.limits import limits_in_force
from schemas.reading import read_scene
from schemas.reading.documents import read_text
from schemas.reading.findings import located
from service.converting.course import convert_course
from service.converting.errors import ConversionError, wrong_at
from service.converting.files import InputFiles, SceneFiles
from service.converting.gltf import convert_glb, convert_gltf
from service.converting.obj import convert_obj
from service.converting.surroundings import convert_ply
from service.converting.task import Conversion, Notes, Task


@dataclass(frozen=True, slots=True)
class FileFormat:
    """A format that is known by the ending of its files."""

    kind: str
    suffix: str
    convert: Callable[[Task], dict[str, Any]]


@dataclass(frozen=True, slots=True)
class JsonFormat:
    """A JSON format that is known by a field that only it has."""

    kind: str
    field: str
    convert: Callable[[Task, object], dict[str, Any]]


FILE_FORMATS = (
    FileFormat("OBJ mesh", ".obj", convert_obj),
    FileFormat("PLY mesh", ".ply", convert_ply),
    FileFormat("binary glTF", ".glb", convert_glb),
)
JSON_FORMATS = (
    JsonFormat("CS171 scene", "cam_config", convert_course),
    JsonFormat("glTF", "asset", convert_gltf),
)
_OURS = {"version", "camera"}


def convert(path: Path, *, root: Path, folder: Path) -> Conversion:
    """Make a scene out of a file of another program.

    Parameters
    ----------
    path
        The file: OBJ, PLY, glTF, GLB, or a CS171 scene in JSON.
    root
        Files that it names are read in this folder and below, never elsewhere.
    folder
        Path of the scene: files in its folder or below are named and not copied.

    Raises
    ------
    OSError
        The file cannot be read.
    ConversionError
        Its format is unknown, or its content is invalid.
    """
    notes = Notes(path.name)
    task = Task(path, path.read_bytes(), notes, InputFiles(root), SceneFiles(folder))
    for known in FILE_FORMATS:
        if path.suffix.lower() == known.suffix:
            return _checked(task, known.kind, known.convert(task))
    return _from_json(task)


def _from_json(task: Task) -> Conversion:
    content = _parsed(task)
    for known in JSON_FORMATS:
        if known.field in content:
            try:
                document = known.convert(task, content)
            except ConversionError as error:
                raise _with_lines(task, error) from error
            task.notes.find_lines(task.content.decode("utf-8-sig"))
            return _checked(task, known.kind, document)
    if content.keys() >= _OURS:
        detail = (
            "This is a scene already. Check it with 'penumbra validate', render it with 'penumbra render'."
        )
        raise wrong_at(task.notes.file, "", detail)
    raise wrong_at(task.notes.file, "", f"This is not a known kind of document. {_offer()}")


def _parsed(task: Task) -> Mapping[str, Any]:
    name = task.notes.file
    try:
        document = read_text(task.content, limits_in_force())
    except SceneError as error:
        if task.path.suffix.lower() not in {".json", ".gltf"}:
            detail = f"Files ending in {task.path.suffix!r} are not known, and this is not JSON. {_offer()}"
            raise wrong_at(name, "", detail) from error
        raise ConversionError(name, task.content, error.errors, error.more) from None
    if document.repeated:
        first = document.repeated[0]
        raise wrong_at(name, "/" + "/".join(map(str, first.location)), first.detail)
    if not isinstance(document.content, Mapping):
        raise wrong_at(name, "", f"This is not a JSON object. {_offer()}")
    return document.content


def _offer() -> str:
    kinds = [*(known.kind for known in FILE_FORMATS), *(known.kind for known in JSON_FORMATS)]
    return f"Known are: {', '.join(kinds)}."


def _with_lines(task: Task, error: ConversionError) -> ConversionError:
    if error.name != task.notes.file or any(problem.line for problem in error.problems):
        return error
    problems = located(task.content.decode("utf-8-sig"), error.problems)
    return ConversionError(error.name, task.content, problems, error.more)


def _checked(task: Task, kind: str, document: dict[str, Any]) -> Conversion:
    """Check the new scene against the scene language, which finds values that a converter accepts."""
    try:
        read_scene(document)
    except SceneError as error:
        raise ConversionError(f"the scene made of {task.notes.file}", b"", error.errors, error.more) from None
    return Conversion(kind, document, tuple(task.notes.taken), task.placed.written)
