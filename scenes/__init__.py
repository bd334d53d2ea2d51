"""Scenes that come with Penumbra: the gallery, hard scenes, an assignment, and the accuracy study."""

from __future__ import annotations

from importlib import resources
from pathlib import Path


def scene_path(name: str) -> Path:
    """Return the path of a scene of the package.

    Parameters
    ----------
    name
        Folder and name, with or without `.json`, such as `gallery/basic` or `study/soft`.

    Raises
    ------
    FileNotFoundError
        There is no such scene; the message lists all scenes.

    Examples
    --------
    >>> scene_path("gallery/basic").name
    'basic.json'
    """
    folder = Path(str(resources.files(__name__)))
    known = {f"{file.parent.name}/{file.stem}": file for file in sorted(folder.glob("*/*.json"))}
    try:
        return known[name.removesuffix(".json")]
    except KeyError:
        raise FileNotFoundError(f"No scene {name!r}. There are {', '.join(known)}.") from None
