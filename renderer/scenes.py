"""Loading scenes: from a file, a dict or a `Scene`, with every problem at once."""

import os
from collections.abc import Mapping
from dataclasses import dataclass, replace

from renderer.assets import AssetSource, FolderAssets, LimitedAssets, NoAssets, asset_source
from schemas.errors import Problem, SceneError
from schemas.limits import Limits
from schemas.quality import Quality
from schemas.reading import read_quality, read_scene, scene_path
from schemas.scene import Scene

Source = str | os.PathLike[str] | bytes | Mapping[str, object] | Scene
"""A path, JSON as bytes, a parsed document, or a checked scene."""

QualitySource = Quality | Mapping[str, object]
"""A checked quality, or one as a request over HTTP has it."""


@dataclass(frozen=True, slots=True, repr=False)
class LoadedScene:
    """A checked scene and the source of its files.

    Attributes
    ----------
    document : schemas.scene.Scene
    assets : AssetSource
    warnings : tuple of Problem
        Values that are valid but pointless.
    """

    document: Scene
    assets: AssetSource
    warnings: tuple[Problem, ...] = ()

    def __repr__(self) -> str:
        """Name and numbers in one line: written out, a document may fill megabytes."""
        shapes, lights = len(self.document.shapes), len(self.document.lights)
        return f"<LoadedScene {self.document.name or 'scene'!r}, {shapes} shapes, {lights} lights>"


def load_scene(
    source: Source | LoadedScene,
    *,
    assets: AssetSource | str | os.PathLike[str] | None = None,
    limits: Limits | None = None,
) -> LoadedScene:
    """Read and check a scene.

    Parameters
    ----------
    source
        A path (its files are then read from its folder), JSON as bytes, a dict, a `schemas.Scene`, or a scene
        that is loaded already, for other `assets` or `limits`.
    assets
        Folder of the files that the scene names, or an `AssetSource`; needed if `source` is not a path.
    limits
        Limits of the scene and its files; by default as ``PENUMBRA_LIMITS__<NAME>`` in the environment
        says, else as `schemas.Limits` does. A `schemas.Scene` is checked already: they bound its files only.

    Raises
    ------
    SceneError
        With every problem in `.errors`.
    OSError
        If the path cannot be read, or `assets` is not a folder.
    TypeError
        If `source` or `assets` is of another kind.

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
    if limits is not None and not isinstance(limits, Limits):
        raise TypeError(f"'limits' must be schemas.Limits(...), not {type(limits).__name__}.")
    if isinstance(source, LoadedScene):
        unchanged = assets is None and limits is None
        return source if unchanged else replace(source, assets=_files(assets, source.assets, limits))
    if isinstance(source, Scene):
        return LoadedScene(source, _files(assets, NoAssets(), limits))
    if isinstance(source, (bytes, Mapping)):
        document, warnings = read_scene(source, limits=limits)
        return LoadedScene(document, _files(assets, NoAssets(), limits), warnings)
    path = scene_path(source)
    document, warnings = read_scene(path.read_bytes(), limits=limits)
    return LoadedScene(document, _files(assets, FolderAssets(path.parent), limits), warnings)


def _files(
    assets: AssetSource | str | os.PathLike[str] | None, otherwise: AssetSource, limits: Limits | None
) -> AssetSource:
    source = otherwise if assets is None else asset_source(assets)
    return source if limits is None else LimitedAssets(source, limits)


def load_request(
    scene: Source | LoadedScene, quality: QualitySource | None
) -> tuple[LoadedScene, Quality | None]:
    """Read and check a scene, and the quality to render it with.

    Raises
    ------
    SceneError
        With every problem of both; pointers into the quality begin with ``/quality``.
    """
    problems: list[Problem] = []
    more = 0
    loaded = asked = None
    try:
        loaded = load_scene(scene)
    except SceneError as error:
        problems, more = [*error.errors], error.more
    try:
        asked = None if quality is None else read_quality(quality)
    except SceneError as error:
        problems, more = [*problems, *error.errors], more + error.more
    if loaded is None or problems:
        raise SceneError(problems, more)
    return loaded, asked
