"""The scene argument of a command: a file, or ``-`` for stdin."""

from __future__ import annotations

import sys
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

from service.cli import output
from service.cli.errors import InputError, UnusableSceneError

if TYPE_CHECKING:
    from renderer import LoadedScene, RenderPlan
    from schemas.errors import Problem, SceneError
    from schemas.quality import Quality
    from service.cli.size_options import SizeOptions

STDIN = "-"


def read_bytes(name: str) -> bytes:
    """The content of a file, or all of stdin.

    Raises
    ------
    InputError
        It cannot be read.
    """
    if not name:
        raise InputError("The name of the scene file is empty.")
    try:
        if name != STDIN:
            return Path(name).read_bytes()
        if sys.stdin is None:
            raise InputError("stdin is closed. Pipe a scene in, or name a file.")
        return sys.stdin.buffer.read()
    except OSError as error:
        raise InputError(f"{name} cannot be read: {error.strerror or error}.") from error


def folder_of(name: str) -> Path:
    """The folder of a scene's textures: that of its file, or the working directory for stdin."""
    return Path() if name == STDIN else Path(name).parent


@dataclass(frozen=True, slots=True)
class SceneFile:
    """A scene with the text that it came from, so that problems can be shown in it."""

    name: str
    text: bytes
    scene: LoadedScene

    def plan(self, quality: Quality | None = None, layers: Sequence[str] = ()) -> RenderPlan:
        """The plan of this scene; what its files are warned of is printed.

        Raises
        ------
        UnusableSceneError
            One of its textures or meshes cannot be used.
        """
        plan = self.compiled(quality, layers)
        print_warnings(self.text, self.about_files(plan))
        return plan

    def compiled(self, quality: Quality | None = None, layers: Sequence[str] = ()) -> RenderPlan:
        """The plan as of `plan`, without printing anything."""
        from renderer import compile_scene
        from schemas.errors import SceneError

        try:
            return compile_scene(self.scene, quality, layers=layers)
        except SceneError as error:
            raise _unusable(self.name, self.text, error) from error

    def about_files(self, plan: RenderPlan) -> list[Problem]:
        """The warnings of a plan beyond those of the scene, with their lines."""
        from schemas.reading.findings import located

        return located(self.text.decode("utf-8-sig"), plan.warnings[len(self.scene.warnings) :])


def load(name: str, *, seed: int | None = None, size: SizeOptions | None = None) -> SceneFile:
    """The scene of a file, checked, with another seed or size if one is given; its warnings are printed.

    Raises
    ------
    InputError
        The file cannot be read.
    UnusableSceneError
        It is not a usable scene.
    """
    file = read(name)
    print_warnings(file.text, file.scene.warnings)
    document = file.scene.document
    changed: dict[str, object] = {}
    if seed is not None:
        changed["sampling"] = document.sampling.model_copy(update={"seed": seed})
    if size:
        changed["camera"] = size.resized(document.camera)
    return replace(file, scene=replace(file.scene, document=document.model_copy(update=changed)))


def read(name: str) -> SceneFile:
    """The scene of a file, checked; its warnings are not printed."""
    from renderer import load_scene
    from renderer.assets import FolderAssets
    from schemas.errors import SceneError

    text = read_bytes(name)
    try:
        return SceneFile(name, text, load_scene(text, assets=FolderAssets(folder_of(name))))
    except SceneError as error:
        raise _unusable(name, text, error) from error


def _unusable(name: str, text: bytes, error: SceneError) -> UnusableSceneError:
    """The error with a line for each pointer: the renderer has the scene and not its text."""
    from schemas.reading.findings import located

    # A problem with a pointer is in a document that was parsed: any other text has no places to look up.
    missing_line = any(problem.line is None and problem.pointer for problem in error.errors)
    problems = located(text.decode("utf-8-sig"), error.errors) if missing_line else error.errors
    return UnusableSceneError(name, text, problems, error.more)


def parsed(text: bytes) -> Mapping[str, Any]:
    """The members of a scene, otherwise unchecked; SceneError if it is not JSON."""
    from schemas.limits import limits_in_force
    from schemas.reading.documents import read_text

    content = read_text(text, limits_in_force(), wanted="a scene").content
    return content if isinstance(content, Mapping) else {}


def print_warnings(text: bytes, warnings: Sequence[Problem]) -> None:
    """Print warnings on stderr: what is valid but probably not meant."""
    for line in output.excerpts(text, warnings, kind="warning"):
        output.say(line)
