"""Meshes and pictures that an input names: checked before the scene names them."""

from __future__ import annotations

from pathlib import Path

from renderer.assets import AssetError, image_size
from renderer.meshes.files import read_mesh
from service.converting.errors import FileAwayError
from service.converting.task import Task


class One:
    """A source that has one file."""

    def __init__(self, content: bytes) -> None:
        self.content = content

    def read(self, _name: str) -> bytes:
        """Give it, whatever it is called."""
        return self.content


def check_mesh(content: bytes) -> None:
    """Read a mesh as the renderer will.

    Raises
    ------
    AssetError
        It could not use it.
    """
    read_mesh("", One(content))


def picture_file(task: Task, folder: Path, name: str) -> str:
    """The scene's name of a picture.

    Raises
    ------
    FileAwayError
        It is not there.
    AssetError
        It is no picture that the renderer reads.
    """
    path, content = task.found.read(folder, name)
    image_size(content)
    return task.placed.keep(path, content)


UNUSABLE = (FileAwayError, AssetError)
"""What is told about a file that cannot be used; both say what to do."""
