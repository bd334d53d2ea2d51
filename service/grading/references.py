"""References: pictures beside the manifest, or scenes there that are rendered once for all tests."""

from __future__ import annotations

import hashlib
import io
import json
from collections.abc import Sequence
from dataclasses import dataclass, replace
from importlib.metadata import version
from pathlib import Path
from typing import Any

import numpy as np

from accuracy.comparison import Picture, picture_of
from accuracy.comparison.decoding import Content, Size
from accuracy.comparison.inputs import PACKED, unpacked
from accuracy.comparison.shown import names_of, shapes_shown
from renderer.errors import ImageFileError, SceneError
from renderer.scenes import LoadedScene, load_scene
from schemas.api.comparisons import Encoding
from schemas.grading.manifests import (
    ImageTest,
    Manifest,
    Reference,
    ReferencePicture,
    ReferenceScene,
    SceneTest,
)
from service.grading.errors import BrokenTestError
from service.grading.folders import Folder, keep
from service.grading.rendering import Ordered, rendered
from service.grading.settings import Run


@dataclass(frozen=True, slots=True)
class Wanted:
    """A reference, the bytes of its file if it was not rendered here, and the scene it shows if known."""

    picture: Picture
    stored: int | None
    scene: LoadedScene | None

    @property
    def names(self) -> Sequence[str]:
        """Names of the shapes, by index."""
        return () if self.scene is None else names_of(self.scene.document)


def wanted(reference: Reference, run: Run) -> Wanted:
    """The reference of a test.

    Raises
    ------
    BrokenTestError
        The reference is unusable.
    """
    scene = reference_scene(reference, run)
    if not isinstance(reference, ReferencePicture):
        return Wanted(reference_picture(reference, run), None, scene)
    stored, picture = read_picture(run.references, reference.file, reference.encoding)
    if scene is None:
        return Wanted(picture, stored, None)
    camera = scene.document.camera
    if (camera.width, camera.height) != (picture.width, picture.height):
        raise BrokenTestError(
            f"{reference.scene} asks for {camera.width} x {camera.height} pixels, and {picture.name} has "
            f"{picture.width} x {picture.height}. Give the scene that it was rendered from."
        )
    shapes = {"shape": shapes_shown(scene)}
    return Wanted(replace(picture, layers={**picture.layers, **shapes}), stored, scene)


def reference_picture(reference: Reference, run: Run) -> Picture:
    """The picture of a reference alone.

    Raises
    ------
    BrokenTestError
        It is unusable.
    """
    if isinstance(reference, ReferencePicture):
        return read_picture(run.references, reference.file, reference.encoding)[1]
    with run.reference(key_of(reference)).open("rb") as archive:
        content, layers = unpacked(archive, reference.file)
    return picture_of(content, reference.file, "linear", layers)


def reference_scene(reference: Reference, run: Run) -> LoadedScene | None:
    """The scene that a reference shows; None if it is unknown.

    Raises
    ------
    BrokenTestError
        It is unusable.
    """
    name = reference.scene if isinstance(reference, ReferencePicture) else reference.file
    return None if name is None else _scene(run.references, name)


def read_picture(
    folder: Folder, name: str, encoding: Encoding, size: Size | None = None
) -> tuple[int, Picture]:
    """The bytes of a file and the picture in it, which must have a size if one is given.

    Raises
    ------
    GradingError
        The file is not a usable picture; the class depends on the folder.
    """
    content: Content = folder.read(name)
    stored = len(content)
    layers = folder.layers(name) if folder.role == "reference" else {}
    try:
        # Submissions may not be packed: they could expand to any size.
        if folder.role == "reference" and name.lower().endswith(PACKED):
            content, packed = unpacked(io.BytesIO(content), name)
            layers = packed | layers
        return stored, picture_of(content, name, encoding, layers, size)
    except ImageFileError as error:
        raise folder.fault(str(error)) from error


def _scene(folder: Folder, name: str) -> LoadedScene:
    try:
        scene = load_scene(folder.read(name), assets=folder.assets(name))
    except SceneError as error:
        raise folder.fault(f"{name} is not a usable scene. {error}") from error
    if scene.document.camera.crop:
        # Mistakes are searched for by rendering the scene with them, smaller and whole.
        raise folder.fault(f"{name} is cropped. Remove /camera/crop: references are whole pictures.")
    return scene


def to_render(manifest: Manifest) -> dict[str, ReferenceScene]:
    """The scenes to render as references, by the key with which tests find them."""
    tests = (test for test in manifest.tests if isinstance(test, ImageTest | SceneTest))
    references = (test.reference for test in tests if isinstance(test.reference, ReferenceScene))
    return {key_of(reference): reference for reference in references}


def key_of(reference: ReferenceScene) -> str:
    """A key that is the same for equal references."""
    return reference.model_dump_json()


def prepare(order: Ordered, folder: Path) -> Path:
    """The .npz file of a rendered reference; it is rendered unless the folder already has it.

    Parameters
    ----------
    folder
        Where it is saved, under a hash of everything the picture depends on.

    Raises
    ------
    GradingError
        It cannot be rendered.
    """
    file = folder / f"{_key(order)}.npz"
    if not file.exists():
        made, content = rendered(order), io.BytesIO()
        arrays: dict[str, Any] = {"image": made.image, **made.layers}
        np.savez(content, **arrays)
        keep(file, content.getvalue())
    return file


def _key(order: Ordered) -> str:
    # Only references are packed, so grading a scene does not wait for the client to load.
    from service.client.parcels import pack  # noqa: PLC0415

    try:
        parcel = pack(order.folder.read(order.file), assets=order.folder.assets(order.file))
    except SceneError as error:
        raise BrokenTestError(f"{order.file} is not a usable scene. {error}") from error
    quality = None if order.quality is None else order.quality.model_dump(mode="json")
    parts = [version("penumbra-render"), parcel.document, quality]
    return hashlib.sha256(json.dumps(parts, sort_keys=True).encode()).hexdigest()
