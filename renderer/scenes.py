"""Loading a scene from wherever it is."""

import os
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

from renderer.assets import AssetSource, FolderAssets, NoAssets
from schemas.limits import Limits
from schemas.problems import Problem
from schemas.reading import DEFAULT_LIMITS, read_scene
from schemas.scene import Scene

Source = str | os.PathLike[str] | bytes | Mapping[str, object] | Scene
"""A path, JSON as bytes, a parsed document, or a checked scene."""


@dataclass(frozen=True, slots=True)
class LoadedScene:
    """A checked scene and the source of its files.

    Attributes
    ----------
    document : schemas.scene.Scene
    assets : AssetSource
    warnings : tuple of Problem
        What is valid but pointless.
    """

    document: Scene
    assets: AssetSource
    warnings: tuple[Problem, ...] = ()


def load_scene(
    source: Source | LoadedScene, *, assets: AssetSource | None = None, limits: Limits = DEFAULT_LIMITS
) -> LoadedScene:
    """Read and check a scene.

    Parameters
    ----------
    source
        A path (its files are then looked for in its folder), JSON as bytes, a dict, or a `schemas.Scene`.
    assets
        Source of the files that the scene names; needed where `source` is no path.
    limits
        How large the scene may be.

    Raises
    ------
    SceneError
        With every problem in `.errors`.
    OSError
        If the path cannot be read.

    Examples
    --------
    >>> scene = load_scene(
    ...     {
    ...         "version": 1,
    ...         "camera": {
    ...             "position": [0, 0, 3],
    ...             "look_at": [0, 0, 0],
    ...             "vertical_fov": 40,
    ...             "width": 4,
    ...             "height": 4,
    ...         },
    ...     }
    ... )
    >>> scene.document.camera.width
    4
    """
    if isinstance(source, LoadedScene):
        return source
    if isinstance(source, Scene):
        return LoadedScene(source, NoAssets() if assets is None else assets)
    if isinstance(source, (bytes, Mapping)):
        document, warnings = read_scene(source, limits=limits)
        return LoadedScene(document, NoAssets() if assets is None else assets, warnings)
    path = Path(source)
    document, warnings = read_scene(path.read_bytes(), limits=limits)
    return LoadedScene(document, FolderAssets(path.parent) if assets is None else assets, warnings)
