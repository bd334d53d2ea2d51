"""References that are scenes: rendered once, and shared by all tests that use the same one."""

from __future__ import annotations

import hashlib
import io
import json
import tempfile
from collections.abc import Iterator
from dataclasses import dataclass
from importlib.metadata import version
from pathlib import Path
from typing import Any

import numpy as np

from accuracy.comparison import Picture, picture_of
from accuracy.comparison.inputs import unpacked
from schemas.grading.manifests import ImageTest, Manifest, ReferenceScene, SceneTest
from service.grading.errors import BrokenTestError
from service.grading.rendering import Ordered, Rendered, rendered

IMAGE, SECONDS = "image", "cpu_seconds"


@dataclass(frozen=True, slots=True)
class Prepared:
    """A rendered reference.

    Attributes
    ----------
    file : Path
        The .npz file that holds it.
    """

    file: Path

    def picture(self, name: str) -> Picture:
        """The picture, ready for comparison."""
        with self.file.open("rb") as archive:
            content, layers = unpacked(archive, name)
        return picture_of(content, name, "linear", layers)


def wanted(manifest: Manifest) -> Iterator[tuple[str, ReferenceScene]]:
    """The scenes to render as references, each once, with the key by which tests find it."""
    seen = set()
    for test in manifest.tests:
        if isinstance(test, ImageTest | SceneTest) and isinstance(test.reference, ReferenceScene):
            key = key_of(test.reference)
            if key not in seen:
                seen.add(key)
                yield key, test.reference


def key_of(reference: ReferenceScene) -> str:
    """A key that is the same for equal references."""
    return reference.model_dump_json()


def prepare(order: Ordered, folder: Path) -> Prepared:
    """Render a reference, unless the folder already has it.

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
        _save(file, rendered(order))
    return Prepared(file)


def _key(order: Ordered) -> str:
    # Only references are packed, so grading a scene does not wait for the client to load.
    from schemas.errors import SceneError  # noqa: PLC0415
    from service.client.parcels import pack  # noqa: PLC0415

    try:
        parcel = pack(order.folder.read(order.file), assets=order.folder.assets(order.file))
    except SceneError as error:
        raise BrokenTestError(f"{order.file} is not a usable scene. {error}") from error
    quality = None if order.quality is None else order.quality.model_dump(mode="json")
    parts = [version("penumbra-render"), parcel.document, quality]
    return hashlib.sha256(json.dumps(parts, sort_keys=True).encode()).hexdigest()


def _save(file: Path, made: Rendered) -> None:
    content = io.BytesIO()
    arrays: dict[str, Any] = {IMAGE: made.image, SECONDS: np.float64(made.cpu_seconds), **made.layers}
    np.savez(content, **arrays)
    with tempfile.NamedTemporaryFile(dir=file.parent, delete=False) as whole:
        whole.write(content.getvalue())
    # Two runs may save the same reference; renaming leaves a complete file.
    Path(whole.name).replace(file)
