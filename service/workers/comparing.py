"""Comparison of two pictures, as a worker runs it."""

from __future__ import annotations

import base64
import json
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from typing import Any, NamedTuple

from numpy.typing import NDArray

import renderer
from accuracy.comparison import Comparison, NotComparableError, Picture, Policy, compare, heat, picture_of
from accuracy.comparison.decoding import Size, size_of
from accuracy.comparison.pixels import Encoding
from accuracy.comparison.shown import names_of, shapes_shown
from schemas.api.comparisons import ComparisonAnswer, ComparisonPictures
from schemas.api.jobs import JobRequest
from schemas.errors import Problem
from service.errors import RefusedError, StoreDamagedError
from service.storage.tiles import TileStore
from service.workers import layers
from service.workers.tasks import ComparedPicture, CompareTask

CODE = "not_comparable"


def compared(task: CompareTask, store: TileStore, assets: renderer.AssetSource) -> ComparisonAnswer:
    """Compare the pictures of a task.

    Raises
    ------
    RefusedError
        If one of them cannot be used, or they cannot be compared.
    """
    answer, drawings = _answered(task, store, assets)
    if not drawings:
        return answer
    # By now the memory of both pictures is free.
    texts = {name: base64.b64encode(drawing).decode("ascii") for name, drawing in drawings.items()}
    return answer.model_copy(update={"images": ComparisonPictures(**texts)})


def _answered(
    task: CompareTask, store: TileStore, assets: renderer.AssetSource
) -> tuple[ComparisonAnswer, dict[str, bytes]]:
    """The answer without its drawings, and their PNG files."""
    with _refusing("/image"):
        image = _sent(task.image, "image", store, assets)
    with _refusing("/reference"):
        reference = _sent(task.reference, "reference", store, assets)
    with _refusing("/image"):
        picture = image.picture(size_of(reference.content))
    # A file may be as large as its pixels.
    del image
    with _refusing("/reference"):
        wanted = reference.picture()
    del reference
    with _refusing(""):
        found = _compared(task, picture, wanted, store, assets)
    drawn = {"heat_map": heat.heat_map, "side_by_side": heat.side_by_side} if task.request.pictures else {}
    drawings = {name: heat.encoded(draw, picture, wanted) for name, draw in drawn.items()}
    return ComparisonAnswer.model_validate(found.document()), drawings


@contextmanager
def _refusing(pointer: str) -> Iterator[None]:
    try:
        yield
    except NotComparableError as error:
        raise RefusedError([Problem(pointer=pointer, detail=str(error), code=CODE)]) from None


class _Sent(NamedTuple):
    """The file of a picture that is to be compared, and its layers."""

    content: bytes
    name: str
    encoding: Encoding | None
    layers: Mapping[str, NDArray[Any]]

    def picture(self, size: Size | None = None) -> Picture:
        """The picture, refused before it is decoded if it has another size than one that is given."""
        return picture_of(self.content, self.name, self.encoding, self.layers, size)


def _sent(asked: ComparedPicture, role: str, store: TileStore, assets: renderer.AssetSource) -> _Sent:
    if asked.job is None:
        content = asked.content if asked.asset is None else _uploaded(asked.asset, assets)
        return _Sent(content, role, asked.encoding, {})
    name = f"{asked.prefix}image.npy"
    names = {layer: f"{asked.prefix}{layers.file_name(layer)}" for layer in asked.layers}
    try:
        content = store.get_file(asked.render, name, asked.expected[name])
        sheets = {
            layer: store.get_array(asked.render, file, asked.expected[file]) for layer, file in names.items()
        }
    except (FileNotFoundError, StoreDamagedError) as error:
        raise NotComparableError("The stored picture is damaged. Submit the job again.") from error
    return _Sent(content, f"job:{asked.job}", asked.encoding, sheets)


def _uploaded(asset: str, assets: renderer.AssetSource) -> bytes:
    try:
        return assets.read(asset)
    except KeyError as error:
        raise NotComparableError("The uploaded file is no longer there. Upload it again.") from error


def _compared(
    task: CompareTask, image: Picture, reference: Picture, store: TileStore, assets: renderer.AssetSource
) -> Comparison:
    asked = task.request
    policy = Policy(tolerance=asked.tolerance, most_bias=asked.max_bias, limit=asked.limit)
    if task.reference.job is None or image.size != reference.size:
        return compare(image, reference, policy=policy, with_flip=asked.flip)
    spec = JobRequest.model_validate(
        json.loads(store.get_spec(task.reference.render, task.reference.spec_sha256))
    )
    scene = renderer.load_scene(spec.scene, assets=assets)
    return compare(
        image,
        reference,
        policy=policy,
        shapes=shapes_shown(scene),
        names=names_of(scene.document),
        with_flip=asked.flip,
    )
