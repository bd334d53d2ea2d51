"""Request bodies: values as JSON, and scenes whose textures and meshes are named by their content hash."""

from __future__ import annotations

import hashlib
import math
from collections.abc import Iterator, Mapping, Sequence
from copy import copy
from dataclasses import dataclass
from os import PathLike
from typing import TYPE_CHECKING, Any

import numpy.typing as npt

from schemas.errors import Problem
from schemas.limits import limits_in_force
from schemas.pointers import Parts
from schemas.reading import scene_path
from schemas.reading.documents import read_text
from schemas.reading.findings import Finding, located, refusal
from schemas.reading.plain import plain
from schemas.reading.translation import say
from schemas.scene import Scene, also_named

if TYPE_CHECKING:
    from renderer.assets import AssetSource

    Assets = AssetSource | str | PathLike[str]

SceneSource = str | PathLike[str] | bytes | Mapping[str, Any] | Scene
PREFIX = "sha256:"
SCENE = "/scene"
NO_FOLDER = (
    "This scene comes without a folder, so there is no such file. Give the path of the scene, or 'assets'."
)


@dataclass(frozen=True, slots=True)
class Parcel:
    """A scene document that a server can use, and the contents it names.

    Attributes
    ----------
    document
        The scene, with ``sha256:<hex>`` in place of file names.
    contents
        Bytes of the textures and meshes by SHA-256, in hexadecimal digits.
    text
        The user's own text, None if the scene was never text.
    """

    document: Mapping[str, Any]
    contents: Mapping[str, bytes]
    text: str | None

    def placed(self, problems: Sequence[Problem]) -> list[Problem]:
        """Problems with the body that was sent, as problems with the user's own document.

        Pointers into the scene lose ``/scene`` and get line and column of the user's text. Others have only
        their pointer: users have not seen the lines of the body.
        """
        return [
            *located(self.text, (_inside(problem) for problem in problems if _is_inside(problem))),
            *(_without_place(problem) for problem in problems if not _is_inside(problem)),
        ]


def pack(scene: SceneSource, assets: Assets | None = None) -> Parcel:
    """Prepare a scene for a request.

    Parameters
    ----------
    scene
        The path of a scene file, its bytes, its document as a dict, or a `schemas.Scene`.
    assets
        The folder where textures and meshes are looked up, or an ``AssetSource``; by default the folder of
        the scene file, and nowhere for other sources.

    Raises
    ------
    schemas.errors.SceneError
        It is not a JSON object, or names a file that is not there.
    OSError
        The file cannot be read, or `assets` is not a folder.
    TypeError
        `scene` or `assets` is of another kind.
    """
    files = None if assets is None else _source(assets)
    if isinstance(scene, Scene):
        scene = scene.model_dump(mode="json", exclude_unset=True)
    if not isinstance(scene, bytes | Mapping):
        path = scene_path(scene)
        scene = path.read_bytes()
        files = _source(path.parent) if files is None else files
    read = read_text(scene, limits_in_force(), wanted="a scene")
    if not isinstance(read.content, Mapping):
        raise refusal([Finding((), "not_an_object", "A scene is a JSON object.")], read.content, read.text)
    contents, missing = _contents(read.content, files)
    if read.repeated or missing:
        raise refusal([*read.repeated, *missing], read.content, read.text)
    _refuse_not_finite(read.content, read.text)
    names = {name: hashlib.sha256(content).hexdigest() for name, content in contents.items()}
    return Parcel(
        document=_renamed(read.content, names),
        contents={names[name]: content for name, content in contents.items()},
        text=read.text,
    )


def _source(assets: Assets) -> AssetSource:
    # Most uses of a client have no textures and need nothing of the renderer.
    from renderer.assets import asset_source  # noqa: PLC0415

    return asset_source(assets)


def _local_files(scene: Mapping[str, Any]) -> Iterator[tuple[str, str | int, str]]:
    """Part, key and file name of each texture and mesh that is a file; oddities are left to the server."""
    textures, shapes = scene.get("textures"), scene.get("shapes")
    things: list[tuple[str, str | int, Any]] = []
    if isinstance(textures, Mapping):
        things += [("textures", key, texture) for key, texture in textures.items()]
    if isinstance(shapes, list | tuple):
        things += [("shapes", number, shape) for number, shape in enumerate(shapes)]
    for part, key, thing in things:
        name = thing.get("asset") if isinstance(thing, Mapping) else None
        if isinstance(name, str) and not name.startswith(PREFIX):
            yield part, key, name


def _contents(scene: Mapping[str, Any], assets: AssetSource | None) -> tuple[dict[str, bytes], list[Finding]]:
    uses: dict[str, list[Parts]] = {}
    for part, key, name in _local_files(scene):
        uses.setdefault(name, []).append((part, key, "asset"))
    contents: dict[str, bytes] = {}
    missing = []
    for name, (first, *others) in uses.items():
        try:
            contents[name] = _content(name, assets, is_mesh=first[0] == "shapes")
        except (ValueError, OSError) as error:
            missing.append(Finding(first, "missing_asset", str(error) + also_named(len(others))))
    return contents, missing


def _content(name: str, assets: AssetSource | None, *, is_mesh: bool) -> bytes:
    """Bytes of a file as they are uploaded: one file, though a glTF mesh may have its buffers in others."""
    if assets is None:
        raise ValueError(NO_FOLDER)
    # Most uses of a client have no files and need nothing of the renderer.
    from renderer.assets import content_of  # noqa: PLC0415
    from renderer.meshes.files import self_contained  # noqa: PLC0415

    content = content_of(name, assets)
    return self_contained(name, content, assets) if is_mesh else content


def _renamed(scene: Mapping[str, Any], names: Mapping[str, str]) -> Mapping[str, Any]:
    renamed = dict(scene)
    for part, key, name in _local_files(scene):
        if renamed[part] is scene[part]:
            renamed[part] = copy(scene[part])
        renamed[part][key] = {**scene[part][key], "asset": PREFIX + names[name]}
    return renamed


def _is_inside(problem: Problem) -> bool:
    return problem.pointer == SCENE or problem.pointer.startswith(SCENE + "/")


def _inside(problem: Problem) -> Problem:
    stripped = problem.model_copy(update={"pointer": problem.pointer.removeprefix(SCENE)})
    return _without_place(stripped)


def _without_place(problem: Problem) -> Problem:
    return problem.model_copy(update={"line": None, "column": None})


def sendable(members: Mapping[str, Any]) -> dict[str, Any]:
    """Members of a request as JSON has them; NumPy and models may be among them.

    Raises
    ------
    schemas.errors.SceneError
        With every value that JSON cannot represent.
    """
    made = {name: plain(value, max_depth=limits_in_force().max_depth) for name, value in members.items()}
    _refuse_not_finite(made, None)
    return made


def rows(origins: npt.ArrayLike, directions: npt.ArrayLike) -> dict[str, Any]:
    """Origins and directions of rays (rays, 3) as lists of numbers, as a request has them.

    Raises
    ------
    ValueError
        One has another shape, or does not hold real numbers.
    """
    # Not before rays are cast: a client needs nothing of the renderer otherwise.
    from renderer.math.arrays import vectors  # noqa: PLC0415

    given = {"origins": origins, "directions": directions}
    return {name: vectors(name, values).tolist() for name, values in given.items()}


def _refuse_not_finite(content: object, text: str | None) -> None:
    """Refuse NaN and infinity, which JSON cannot carry.

    Parameters
    ----------
    text
        The text of the content, for lines and columns of errors; None if it never was text.

    Raises
    ------
    schemas.errors.SceneError
        With the place of each of them.
    """
    findings = [Finding(parts, *say("finite_number", "", {})) for parts in _not_finite(content, ())]
    if findings:
        raise refusal(findings, content, text)


def _not_finite(node: object, parts: Parts) -> Iterator[Parts]:
    if isinstance(node, float):
        if not math.isfinite(node):
            yield parts
    elif isinstance(node, Mapping):
        for name, member in node.items():
            yield from _not_finite(member, (*parts, name))
    elif isinstance(node, list):
        for number, entry in enumerate(node):
            # Most entries are numbers that need no place.
            if type(entry) is not float or not math.isfinite(entry):
                yield from _not_finite(entry, (*parts, number))
